# Unit tests: each links the library's archive, so that it can reach what is hidden.
dist_check_SCRIPTS += %D%/layers.sh
TESTS += %D%/layers.sh

if HAVE_CMOCKA
check_PROGRAMS += tests/unit/base
TESTS += tests/unit/base
tests_unit_base_SOURCES = %D%/base.c
tests_unit_base_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
endif

if HAVE_CMOCKA
check_PROGRAMS += tests/unit/image_file tests/unit/preview
TESTS += tests/unit/image_file tests/unit/preview
tests_unit_image_file_CPPFLAGS = $(AM_CPPFLAGS) -I$(top_srcdir) $(CMOCKA_CFLAGS)
tests_unit_image_file_SOURCES = tests/unit/image_file.c
tests_unit_image_file_LDADD = libcli.la $(CMOCKA_LIBS)
tests_unit_preview_CPPFLAGS = $(AM_CPPFLAGS) -I$(top_srcdir) $(CMOCKA_CFLAGS)
tests_unit_preview_SOURCES = tests/unit/preview.c
tests_unit_preview_LDADD = libcli.la $(CMOCKA_LIBS) -lm
endif

if HAVE_CMOCKA
check_PROGRAMS += tests/unit/levels tests/unit/predicate tests/unit/topology
TESTS += tests/unit/levels tests/unit/predicate tests/unit/topology
tests_unit_levels_SOURCES = %D%/levels.c %D%/shapes.h
tests_unit_levels_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
tests_unit_predicate_SOURCES = %D%/predicate.c
tests_unit_predicate_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
tests_unit_topology_SOURCES = %D%/topology.c %D%/shapes.h
tests_unit_topology_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
endif

if HAVE_CMOCKA
check_PROGRAMS += tests/unit/test_bvh
TESTS += tests/unit/test_bvh
tests_unit_test_bvh_SOURCES = %D%/test_bvh.c %D%/shapes.h
tests_unit_test_bvh_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
endif

if HAVE_CMOCKA
check_PROGRAMS += tests/unit/test_samples tests/unit/test_rays tests/unit/test_contact \
  tests/unit/test_raytrace
TESTS += tests/unit/test_samples tests/unit/test_rays tests/unit/test_contact \
  tests/unit/test_raytrace
tests_unit_test_samples_SOURCES = %D%/test_samples.c %D%/trace_scene.h
tests_unit_test_samples_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
tests_unit_test_rays_SOURCES = %D%/test_rays.c %D%/trace_scene.h
tests_unit_test_rays_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
tests_unit_test_contact_SOURCES = %D%/test_contact.c %D%/trace_scene.h
tests_unit_test_contact_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
tests_unit_test_raytrace_SOURCES = %D%/test_raytrace.c %D%/trace_scene.h
tests_unit_test_raytrace_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
endif

include %D%/mesh.mk

include %D%/exact.mk

include %D%/maps.mk

if HAVE_CMOCKA
if HAVE_X86
check_PROGRAMS += tests/unit/lanes
TESTS += tests/unit/lanes
tests_unit_lanes_SOURCES = %D%/lanes.c %D%/lanes.h %D%/lanes_results.h %D%/lanes_plain.c \
  %D%/lanes_sse2.c
tests_unit_lanes_CPPFLAGS = $(AM_CPPFLAGS) -I$(top_srcdir)/tests $(CMOCKA_CFLAGS)
tests_unit_lanes_LDADD = $(CMOCKA_LIBS) -lm
endif
endif
