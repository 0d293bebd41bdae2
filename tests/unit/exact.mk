if HAVE_CMOCKA
check_PROGRAMS += tests/unit/test_exact tests/unit/test_coverage
TESTS += tests/unit/test_exact tests/unit/test_coverage
tests_unit_test_exact_SOURCES = %D%/test_exact.c %D%/shapes.h
tests_unit_test_exact_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
tests_unit_test_coverage_SOURCES = %D%/test_coverage.c
tests_unit_test_coverage_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)

check_PROGRAMS += tests/unit/test_plates
TESTS += tests/unit/test_plates
tests_unit_test_plates_SOURCES = %D%/test_plates.c %D%/shapes.h
tests_unit_test_plates_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)

check_PROGRAMS += tests/unit/lod
TESTS += tests/unit/lod
tests_unit_lod_SOURCES = %D%/lod.c %D%/shapes.h
tests_unit_lod_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
endif
