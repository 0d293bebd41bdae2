# The reader for OpenImageIO: through its own interface, and in its own tools.
check_PROGRAMS += tests/plugins/oiio/reader
tests_plugins_oiio_reader_SOURCES = %D%/reader.cc
tests_plugins_oiio_reader_CPPFLAGS = $(AM_CPPFLAGS) $(OIIO_CFLAGS)
tests_plugins_oiio_reader_LDADD = $(OIIO_LIBS) -lpthread
TESTS += tests/plugins/oiio/reader
dist_check_SCRIPTS += %D%/tools.sh
TESTS += %D%/tools.sh
