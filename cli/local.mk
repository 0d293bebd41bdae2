# The command line. Its readers and writers make one archive, which unit tests link, too.
noinst_LTLIBRARIES += libcli.la
libcli_la_SOURCES = \
  %D%/error.c %D%/error.h \
  %D%/number.cc %D%/number.h \
  %D%/numbers.c %D%/numbers.h \
  %D%/text_buffer.c %D%/text_buffer.h \
  %D%/input.c %D%/input.h \
  %D%/output.c %D%/output.h \
  %D%/options.c %D%/options.h \
  %D%/light.c %D%/light.h \
  %D%/build_options.c %D%/build_options.h \
  %D%/progress.c %D%/progress.h \
  %D%/scene.c %D%/scene.h
# The C++ here is a face for header-only code: without exceptions it links as C.
libcli_la_CXXFLAGS = $(AM_CXXFLAGS) -fno-exceptions -fno-rtti
libcli_la_CPPFLAGS = $(AM_CPPFLAGS)
libcli_la_LIBADD =

bin_PROGRAMS += softshadow
softshadow_SOURCES = \
  %D%/main.c %D%/commands.h \
  %D%/backends.c %D%/backends.h \
  %D%/info.c \
  %D%/maps.c \
  %D%/methods.c
# Only the public header: what the library hides stays hidden from its own command line.
softshadow_LDADD = libcli.la libsoftshadow.la -lm -lpthread

dist_man_MANS += %D%/softshadow.1

bashcompletiondir = $(datadir)/bash-completion/completions
dist_bashcompletion_DATA = %D%/completion/softshadow

include %D%/image/local.mk
include %D%/mesh/local.mk
include %D%/points/local.mk
include %D%/query/local.mk
include %D%/bench/local.mk
include %D%/render/local.mk
include %D%/explain/local.mk
include %D%/povray/local.mk
