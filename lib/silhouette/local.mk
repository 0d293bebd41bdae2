# Edges seen from one point, found by a hierarchy.
libsoftshadow_core_la_SOURCES += \
  %D%/find.c %D%/silhouette.h \
  %D%/tree.c %D%/tree.h
