# Our own BVH; Embree, through dlopen.
libsoftshadow_core_la_SOURCES += \
  %D%/bvh.c %D%/bvh.h \
  %D%/bvh_build.c %D%/bvh_node.h \
  %D%/shaft.c %D%/shaft.h
