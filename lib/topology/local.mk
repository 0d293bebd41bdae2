libsoftshadow_core_la_SOURCES += \
  %D%/components.c \
  %D%/edges.c %D%/edges.h \
  %D%/openmesh.cc %D%/openmesh.h \
  %D%/report.c \
  %D%/topology.c %D%/topology.h \
  %D%/weld.c %D%/weld.h
# For programs in C that link the archive, as the unit tests do: libtool keeps -lstdc++ and -lm among
# what an archive needs only if it was made with the C compiler.
libsoftshadow_core_la_LIBADD += -lstdc++
libsoftshadow_core_la_LINK = $(LINK)
