# What is installed: used from outside, as a package.
dist_check_SCRIPTS += %D%/examples.sh
# TESTS += %D%/examples.sh
