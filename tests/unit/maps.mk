# Silhouettes, frames, drawing, map techniques.
if HAVE_CMOCKA
map_tests = tests/unit/silhouette tests/unit/raster tests/unit/ink tests/unit/lamp
check_PROGRAMS += $(map_tests)
TESTS += $(map_tests)
tests_unit_silhouette_SOURCES = tests/unit/silhouette.c tests/unit/shapes.h
tests_unit_silhouette_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
tests_unit_lamp_SOURCES = tests/unit/lamp.c
tests_unit_lamp_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS) -lm
tests_unit_ink_SOURCES = tests/unit/ink.c tests/unit/shapes.h
tests_unit_ink_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS) -lm
tests_unit_raster_SOURCES = tests/unit/raster.c tests/unit/shapes.h
tests_unit_raster_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
endif
