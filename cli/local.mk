# The command line. Its readers and writers make one archive, which unit tests link, too.
noinst_LTLIBRARIES += libcli.la
libcli_la_SOURCES = \
  %D%/error.c %D%/error.h \
  %D%/number.cc %D%/number.h
# The C++ here is a face for header-only code: without exceptions it links as C.
libcli_la_CXXFLAGS = $(AM_CXXFLAGS) -fno-exceptions -fno-rtti
