# Image files: the program finds and loads a module, so that only commands that touch an image pay
# for OpenImageIO.
libcli_la_SOURCES += %D%/channels.c %D%/image.h %D%/load.c
libcli_la_CPPFLAGS += -DSOFTSHADOW_MODULE_DIR='"$(pkglibdir)"'
libcli_la_LIBADD += -ldl

pkglib_LTLIBRARIES += softshadow-image.la
softshadow_image_la_SOURCES = %D%/image.cc %D%/image.h
softshadow_image_la_CPPFLAGS = $(AM_CPPFLAGS) $(OIIO_CFLAGS)
softshadow_image_la_LIBADD = $(OIIO_LIBS)
softshadow_image_la_LDFLAGS = -module -avoid-version -export-symbols-regex '^softshadow_image_module$$'
