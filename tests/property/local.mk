# Scenes, oracles and questions: shared by every test that puts methods to the proof. They see the
# library as a host does: its header and its shared object.
if HAVE_CMOCKA
check_LTLIBRARIES += libsoftshadow-proof.la
libsoftshadow_proof_la_SOURCES = \
  tests/scenes.c tests/scenes_bench.c tests/scenes.h tests/figure10.c tests/figure10.h tests/ask.c tests/ask.h \
  tests/oracle/closed.c tests/oracle/union.c tests/oracle/brute.c tests/oracle/oracle.h
libsoftshadow_proof_la_CPPFLAGS = $(PROOF_CPPFLAGS)
PROOF_CPPFLAGS = -I$(top_srcdir)/lib -I$(top_srcdir)/tests $(CMOCKA_CFLAGS)
PROOF_LIBS = libsoftshadow-proof.la libsoftshadow.la $(CMOCKA_LIBS) -lm -lpthread

oracles = tests/oracle/self
proofs = %D%/closed_forms %D%/relations %D%/bits %D%/inputs \
  %D%/levels %D%/measures %D%/random_scenes %D%/sky
check_PROGRAMS += $(oracles) $(proofs)
TESTS += $(oracles) $(proofs)

tests_oracle_self_CPPFLAGS = $(PROOF_CPPFLAGS)
tests_oracle_self_LDADD = $(PROOF_LIBS)
%C%_closed_forms_SOURCES = %D%/closed_forms.c %D%/truth.h
%C%_closed_forms_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_closed_forms_LDADD = $(PROOF_LIBS)
%C%_relations_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_relations_LDADD = $(PROOF_LIBS)
%C%_bits_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_bits_LDADD = $(PROOF_LIBS)
%C%_inputs_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_inputs_LDADD = $(PROOF_LIBS)
%C%_levels_SOURCES = %D%/levels.c %D%/truth.h
%C%_levels_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_levels_LDADD = $(PROOF_LIBS)
%C%_measures_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_measures_LDADD = $(PROOF_LIBS)
%C%_sky_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_sky_LDADD = $(PROOF_LIBS)
%C%_random_scenes_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_random_scenes_LDADD = $(PROOF_LIBS)
endif

# Techniques that work from maps.
if HAVE_CMOCKA
map_proofs = %D%/maps %D%/maps_area %D%/maps_figure10 %D%/maps_cournia %D%/maps_limit %D%/maps_parts \
  %D%/maps_skip
check_PROGRAMS += $(map_proofs)
TESTS += $(map_proofs)
%C%_maps_SOURCES = %D%/maps.c %D%/maps.h
%C%_maps_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_maps_LDADD = $(PROOF_LIBS)
%C%_maps_area_SOURCES = %D%/maps_area.c %D%/maps.h
%C%_maps_area_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_maps_area_LDADD = $(PROOF_LIBS)
%C%_maps_figure10_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_maps_figure10_LDADD = $(PROOF_LIBS)
%C%_maps_cournia_SOURCES = %D%/maps_cournia.c %D%/maps.h
%C%_maps_cournia_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_maps_cournia_LDADD = $(PROOF_LIBS)
%C%_maps_limit_SOURCES = %D%/maps_limit.c %D%/maps.h
%C%_maps_limit_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_maps_limit_LDADD = $(PROOF_LIBS)
%C%_maps_parts_SOURCES = %D%/maps_parts.c %D%/maps.h
%C%_maps_parts_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_maps_parts_LDADD = $(PROOF_LIBS)
%C%_maps_skip_SOURCES = %D%/maps_skip.c %D%/maps.h
%C%_maps_skip_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_maps_skip_LDADD = $(PROOF_LIBS)
endif

# The same on a GPU: Mesa's llvmpipe does as one.
if HAVE_CMOCKA
gpu_proofs = %D%/gpu
check_PROGRAMS += $(gpu_proofs)
TESTS += $(gpu_proofs)
EXTRA_DIST += tests/gpu.h
%C%_gpu_SOURCES = %D%/gpu.c %D%/maps.h
%C%_gpu_CPPFLAGS = $(PROOF_CPPFLAGS)
%C%_gpu_LDADD = $(PROOF_LIBS)
endif

# make check-scalar: as on a host without AVX2. bits is left out: check-bits compares all rungs.
if HAVE_CMOCKA
scalar_proofs = %D%/closed_forms %D%/relations %D%/inputs %D%/measures %D%/random_scenes %D%/maps
check-scalar: $(scalar_proofs)
	@bad=0; for test in $(scalar_proofs); do \
	  if SOFTSHADOW_CPU=scalar ./$$test >$$test.scalar.log 2>&1; then \
	    echo "PASS: $$test, scalar"; rm -f $$test.scalar.log; \
	  else echo "FAIL: $$test, scalar: $$test.scalar.log ends:"; tail -n 20 $$test.scalar.log; bad=1; fi; \
	done; exit $$bad
endif
.PHONY: check-scalar
