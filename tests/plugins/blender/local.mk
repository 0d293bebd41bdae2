# The add-on in a real Blender: without a window, and on a virtual screen.
blender_tests = %D%/bake.py %D%/path_traced.py %D%/missing.py %D%/window.py
dist_check_SCRIPTS += $(blender_tests)
EXTRA_DIST += %D%/host.py %D%/scenes.py
TESTS += $(blender_tests)
