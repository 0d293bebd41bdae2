libsoftshadow_core_la_SOURCES += \
  %D%/cache.c %D%/cache.h \
  %D%/closest.c %D%/closest.h \
  %D%/components.c \
  %D%/decimate.c %D%/decimate.h \
  %D%/edges.c %D%/edges.h \
  %D%/fins.c %D%/fins.h \
  %D%/hash.c %D%/hash.h \
  %D%/levels.c %D%/levels.h \
  %D%/openmesh.cc %D%/openmesh.h \
  %D%/quadric.h \
  %D%/report.c \
  %D%/simplify.c %D%/simplify.h \
  %D%/solids.c %D%/solids.h \
  %D%/topology.c %D%/topology.h \
  %D%/weld.c %D%/weld.h
# For programs in C that link the archive, as the unit tests do: libtool keeps -lstdc++ and -lm
# among what an archive needs only if it was made with the C compiler.
libsoftshadow_core_la_LIBADD += -lstdc++
libsoftshadow_core_la_LINK = $(LINK)
