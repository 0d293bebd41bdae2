# The program itself, run as a user would.
cli_tests = %D%/usage.py %D%/formats.py %D%/streaming.py %D%/faults.py %D%/parts.py %D%/images.py \
  %D%/hostile.py %D%/maps.py %D%/pictures.sh %D%/bench.py
dist_check_SCRIPTS += $(cli_tests)
EXTRA_DIST += %D%/command.py
TESTS += $(cli_tests)
