EXTRA_DIST += %D%/results.csv %D%/llvmpipe.csv %D%/maps.csv %D%/plot_maps.py
# Built by name only: make tests/bench/decimate
EXTRA_PROGRAMS += tests/bench/decimate
tests_bench_decimate_SOURCES = %D%/decimate.cc
tests_bench_decimate_LDADD = libsoftshadow-core.la -lOpenMeshTools
# The compiler sees ghosts in OpenMesh's vectors.
tests_bench_decimate_CXXFLAGS = $(AM_CXXFLAGS) -Wno-maybe-uninitialized

# make bench: the library against Embree at equal error. BENCH_FLAGS= measures every scene, three times.
BENCH_FLAGS = --quick
bench: all
	@$(MKDIR_P) bench
	./softshadow bench --peer $(BENCH_FLAGS) --csv bench/results.csv --times bench/times.csv
.PHONY: bench
clean-local-bench:
	-rm -f bench/results.csv bench/times.csv
	-rmdir bench 2>/dev/null
clean-local: clean-local-bench
.PHONY: clean-local-bench
