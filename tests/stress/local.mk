# make check-stress: where arithmetic hurts, as a table (stress/sweep.csv); STRESS_SCENES (10,000)
# random scenes against exact areas; STRESS_AIMED (10,000,000) points behind vertices and edges of closed
# meshes; for each method STRESS_POINTS (1,000,000) points and STRESS_MESHES (20,000) meshes of random bits
# and STRESS_CHILDREN (80) forks of each kind; STRESS_CROWD (1,000,000) points from each
# of 16 threads; the library loaded and let go STRESS_LOADS (1,000) times.
EXTRA_DIST += %D%/sweep.csv
if HAVE_CMOCKA
EXTRA_PROGRAMS += tests/stress/sweep tests/stress/scenes
tests_stress_sweep_SOURCES = %D%/sweep.c %D%/cases.c %D%/ask.c %D%/stress.h
tests_stress_sweep_CPPFLAGS = $(PROOF_CPPFLAGS)
tests_stress_sweep_LDADD = $(PROOF_LIBS)
tests_stress_scenes_SOURCES = %D%/scenes.c %D%/ask.c %D%/stress.h
tests_stress_scenes_CPPFLAGS = $(PROOF_CPPFLAGS)
tests_stress_scenes_LDADD = $(PROOF_LIBS)

# These are of make check, too, where they do little.
stress = %D%/leaks %D%/noise %D%/crowd
check_PROGRAMS += $(stress)
TESTS += $(stress)
%C%_leaks_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_leaks_LDADD = $(PROOF_LIBS)
%C%_noise_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_noise_LDADD = $(PROOF_LIBS)
%C%_crowd_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_crowd_LDADD = $(PROOF_LIBS)

STRESS_SCENES = 10000
STRESS_LOADS = 1000
STRESS_AIMED = 10000000
STRESS_POINTS = 1000000
STRESS_MESHES = 20000
STRESS_CHILDREN = 80
STRESS_CROWD = 1000000
check-stress: tests/stress/sweep tests/stress/scenes tests/abi/dlopen tests/abi/fork $(stress) libsoftshadow.la
	@$(MKDIR_P) stress
	./tests/stress/sweep --csv stress/sweep.csv
	./tests/stress/scenes 0 $(STRESS_SCENES)
	./tests/stress/leaks $(STRESS_AIMED)
	./tests/stress/noise $(STRESS_POINTS) $(STRESS_MESHES)
	./tests/stress/crowd $(STRESS_CROWD)
	./tests/abi/fork $(STRESS_CHILDREN)
	top_builddir=. ./tests/abi/dlopen $(STRESS_LOADS)

endif
clean-local-stress:
	-rm -f stress/sweep.csv
	-rmdir stress 2>/dev/null
clean-local: clean-local-stress
.PHONY: check-stress clean-local-stress
