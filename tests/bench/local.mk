EXTRA_DIST += %D%/front.csv %D%/results.csv %D%/llvmpipe.csv %D%/maps.csv %D%/plot_maps.py \
  %D%/browser.py %D%/check.py %D%/front.py %D%/plots.py %D%/report.css %D%/report.py
bench_tests = %D%/check_test.py %D%/front_test.py %D%/page.py
dist_check_SCRIPTS += $(bench_tests)
TESTS += $(bench_tests)
# Built by name only: make tests/bench/decimate
EXTRA_PROGRAMS += tests/bench/decimate
tests_bench_decimate_SOURCES = %D%/decimate.cc
tests_bench_decimate_LDADD = libsoftshadow-core.la -lOpenMeshTools
# The compiler sees ghosts in OpenMesh's vectors.
tests_bench_decimate_CXXFLAGS = $(AM_CXXFLAGS) -Wno-maybe-uninitialized

# make bench: the library and Embree, run time against error, as one page with pictures. BENCH_FLAGS=
# measures every scene at every setting.
BENCH_FLAGS = --quick
BENCH_SWEEPS = --sweep triangles,points,light,resolution,threads
BENCH_PICTURES = --scenes bunny,leaves-2k --lights medium
BENCH_DIR = bench
bench: all
	@$(MKDIR_P) $(BENCH_DIR)
	./softshadow bench $(BENCH_FLAGS) --csv $(BENCH_DIR)/matrix.csv --json $(BENCH_DIR)/matrix.json
	./softshadow bench $(BENCH_FLAGS) $(BENCH_SWEEPS) --csv $(BENCH_DIR)/sweep.csv
	./softshadow bench $(BENCH_PICTURES) --pictures $(BENCH_DIR)/pictures --csv $(BENCH_DIR)/pictures.csv
	$(PYTHON) $(srcdir)/%D%/report.py $(BENCH_DIR)
# Whether ratios or errors are worse than results.csv says: minutes, and no part of make check.
bench-check: all
	$(PYTHON) $(srcdir)/%D%/check.py $(srcdir)/%D%/results.csv --run ./softshadow
# Whether auto is on the front of every scene under every light: see front.py.
FRONT_FLAGS =
bench-front: all
	@$(MKDIR_P) $(BENCH_DIR)
	$(PYTHON) $(srcdir)/%D%/front.py --run ./softshadow csv=$(BENCH_DIR)/front.csv $(FRONT_FLAGS)
# On a machine with nothing else to do: the page with everything on it, and front.csv anew, which is
# kept, as it has ratios and errors, no times. Half an hour.
bench-record: all
	$(MAKE) $(AM_MAKEFLAGS) bench BENCH_FLAGS=
	-$(MAKE) $(AM_MAKEFLAGS) bench-front
	cp $(BENCH_DIR)/front.csv $(srcdir)/%D%/front.csv
.PHONY: bench bench-check bench-front bench-record
clean-local-bench:
	-rm -rf bench
clean-local: clean-local-bench
.PHONY: clean-local-bench
