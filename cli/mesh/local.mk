# Mesh files; cli/mesh/mesh.h is what others include.
libcli_la_CPPFLAGS += -I$(top_srcdir)/cli
libcli_la_SOURCES += \
  %D%/builder.c %D%/builder.h \
  %D%/bytes.h \
  %D%/mesh.c %D%/mesh.h \
  %D%/obj.c \
  %D%/off.c \
  %D%/ply.c %D%/ply.h %D%/ply_header.c \
  %D%/polygon.c %D%/polygon.h \
  %D%/readers.h \
  %D%/source.c %D%/source.h \
  %D%/stl.c
libcli_la_LIBADD += -lm
