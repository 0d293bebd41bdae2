# The readers of mesh files, linked from the command line's archive.
if HAVE_CMOCKA
mesh_tests = tests/unit/mesh_read tests/unit/mesh_polygon tests/unit/mesh_hostile
check_PROGRAMS += $(mesh_tests)
TESTS += $(mesh_tests)
mesh_test_cppflags = $(AM_CPPFLAGS) -I$(top_srcdir) -I$(top_srcdir)/cli
tests_unit_mesh_read_CPPFLAGS = $(mesh_test_cppflags)
tests_unit_mesh_read_SOURCES = %D%/mesh_read.c %D%/mesh_files.h
tests_unit_mesh_read_LDADD = libcli.la $(CMOCKA_LIBS) -lm
tests_unit_mesh_polygon_CPPFLAGS = $(mesh_test_cppflags)
tests_unit_mesh_polygon_SOURCES = %D%/mesh_polygon.c
tests_unit_mesh_polygon_LDADD = libcli.la $(CMOCKA_LIBS) -lm
tests_unit_mesh_hostile_CPPFLAGS = $(mesh_test_cppflags)
tests_unit_mesh_hostile_SOURCES = %D%/mesh_hostile.c %D%/mesh_files.h
tests_unit_mesh_hostile_LDADD = libcli.la $(CMOCKA_LIBS) -lm
endif

dist_check_SCRIPTS += %D%/info.sh
TESTS += %D%/info.sh
