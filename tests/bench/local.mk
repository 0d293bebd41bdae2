# Built by name only: make tests/bench/decimate
EXTRA_PROGRAMS += tests/bench/decimate
tests_bench_decimate_SOURCES = %D%/decimate.cc
tests_bench_decimate_LDADD = libsoftshadow-core.la -lOpenMeshTools
# The compiler sees ghosts in OpenMesh's vectors.
tests_bench_decimate_CXXFLAGS = $(AM_CXXFLAGS) -Wno-maybe-uninitialized
