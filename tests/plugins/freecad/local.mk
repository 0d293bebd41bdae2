# The Python package in a real FreeCAD.
freecad_tests = %D%/solids.py
dist_check_SCRIPTS += $(freecad_tests)
TESTS += $(freecad_tests)
