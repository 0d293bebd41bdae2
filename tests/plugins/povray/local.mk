# softshadow povray in the real POV-Ray.
dist_check_SCRIPTS += %D%/scenes.sh
TESTS += %D%/scenes.sh
