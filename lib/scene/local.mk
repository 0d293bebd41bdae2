# Meshes and lights as given, checked; the world that the engines read.
libsoftshadow_core_la_SOURCES += \
  %D%/connectivity.h \
  %D%/levels.h \
  %D%/light.c %D%/light.h \
  %D%/light_parts.c %D%/light_parts.h \
  %D%/point.h \
  %D%/scene.c %D%/scene.h \
  %D%/world.c
