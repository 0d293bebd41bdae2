# Our own BVH; Embree, through dlopen; contact in double; sample sets.
libsoftshadow_core_la_SOURCES += \
  %D%/bvh.c %D%/bvh.h \
  %D%/bvh_build.c %D%/bvh_node.h \
  %D%/contact.c %D%/contact.h \
  %D%/distinct.c %D%/distinct.h \
  %D%/lod.c %D%/lod.h \
  %D%/outline.c %D%/outline.h \
  %D%/rays.c %D%/rays.h \
  %D%/samples.c %D%/samples.h \
  %D%/shaft.c %D%/shaft.h
