# make check: everything in seconds. Stress, fuzz and bench have commands of their own.
EXTRA_DIST += %D%/README.md %D%/sanitized.sh %D%/coverage.sh %D%/coverage.py
include %D%/unit/local.mk
include %D%/property/local.mk
include %D%/abi/local.mk
include %D%/bench/local.mk
include %D%/cli/local.mk
include %D%/fuzz/local.mk
include %D%/stress/local.mk
include %D%/install/local.mk
include %D%/plugins/local.mk

# make check-coverage: see coverage.sh.
check-coverage:
	@$(AM_TESTS_ENVIRONMENT) ALL_TESTS='$(TESTS)' $(SHELL) $(srcdir)/%D%/coverage.sh
.PHONY: check-coverage
