# OpenImageIO looks for NAME.imageio.so; the readers and the picture are the command line's.
EXTRA_DIST += %D%/README.md %D%/relit.png %D%/scene.softshadow
oiioexecdir = $(pkglibdir)/oiio
oiioexec_LTLIBRARIES = softshadow.imageio.la
softshadow_imageio_la_SOURCES = %D%/softshadow_input.cc
softshadow_imageio_la_CPPFLAGS = $(AM_CPPFLAGS) -I$(top_srcdir) $(OIIO_CFLAGS)
softshadow_imageio_la_LIBADD = libcli.la libsoftshadow.la $(OIIO_LIBS)
softshadow_imageio_la_LDFLAGS = -module -avoid-version \
  -export-symbols-regex '^softshadow_(imageio|input)_'

# Installing links it anew with the library where that is then. The variable hides from automake that
# this adds to a rule of its own.
oiio_install = install-oiioexecLTLIBRARIES
$(oiio_install): install-libLTLIBRARIES
