if HAVE_CMOCKA
check_PROGRAMS += tests/unit/test_exact
TESTS += tests/unit/test_exact
tests_unit_test_exact_SOURCES = %D%/test_exact.c %D%/shapes.h
tests_unit_test_exact_LDADD = libsoftshadow-core.la $(CMOCKA_LIBS)
endif
