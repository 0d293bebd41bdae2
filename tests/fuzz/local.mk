# make check-fuzz: libFuzzer, which comes with clang, on everything that reads what others wrote. The
# programs are built by name only, in a build of their own: see run.sh. corpus/ holds what they start
# from: a file of each kind, few and small, to be read by people, and for the ABI two dozen tapes that ten
# minutes of fuzzing left; NAME.dict the words of its language.
EXTRA_DIST += %D%/run.sh %D%/corpus %D%/light.dict %D%/mesh.dict %D%/points.dict %D%/scene.dict
fuzzers = tests/fuzz/fuzz_mesh tests/fuzz/fuzz_points tests/fuzz/fuzz_light tests/fuzz/fuzz_scene \
  tests/fuzz/fuzz_abi
EXTRA_PROGRAMS += $(fuzzers)
fuzz_cppflags = $(AM_CPPFLAGS) -I$(top_srcdir)/cli
fuzz_ldflags = -fsanitize=fuzzer
tests_fuzz_fuzz_mesh_SOURCES = %D%/fuzz_mesh.c
tests_fuzz_fuzz_mesh_CPPFLAGS = $(fuzz_cppflags)
tests_fuzz_fuzz_mesh_LDFLAGS = $(fuzz_ldflags)
tests_fuzz_fuzz_mesh_LDADD = libcli.la -lm -lstdc++
tests_fuzz_fuzz_points_SOURCES = %D%/fuzz_points.c
tests_fuzz_fuzz_points_CPPFLAGS = $(fuzz_cppflags)
tests_fuzz_fuzz_points_LDFLAGS = $(fuzz_ldflags)
tests_fuzz_fuzz_points_LDADD = libcli.la -lm -lstdc++
tests_fuzz_fuzz_light_SOURCES = %D%/fuzz_light.c
tests_fuzz_fuzz_light_CPPFLAGS = $(fuzz_cppflags)
tests_fuzz_fuzz_light_LDFLAGS = $(fuzz_ldflags)
tests_fuzz_fuzz_light_LDADD = libcli.la libsoftshadow.la -lm -lstdc++
tests_fuzz_fuzz_scene_SOURCES = %D%/fuzz_scene.c
tests_fuzz_fuzz_scene_CPPFLAGS = $(fuzz_cppflags)
tests_fuzz_fuzz_scene_LDFLAGS = $(fuzz_ldflags)
tests_fuzz_fuzz_scene_LDADD = libcli.la libsoftshadow.la -lm -lstdc++
tests_fuzz_fuzz_abi_SOURCES = %D%/fuzz_abi.c
tests_fuzz_fuzz_abi_CPPFLAGS = $(AM_CPPFLAGS)
tests_fuzz_fuzz_abi_LDFLAGS = $(fuzz_ldflags)
tests_fuzz_fuzz_abi_LDADD = libsoftshadow.la -lm

check-fuzz:
	@fuzzers='$(notdir $(fuzzers))' $(SHELL) $(srcdir)/%D%/run.sh
.PHONY: check-fuzz
