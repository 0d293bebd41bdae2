# The Python package: each file is run as it is and once more without numpy.
python_tests = %D%/layout.py %D%/answers.py %D%/arrays.py %D%/failures.py %D%/callbacks.py \
  %D%/life.py %D%/installed.py
dist_check_SCRIPTS += $(python_tests)
EXTRA_DIST += %D%/package.py
TESTS += $(python_tests)
