# render: a rasteriser for first hits, the library for visibility.
libcli_la_SOURCES += \
  %D%/camera.c %D%/camera.h \
  %D%/normals.c %D%/normals.h \
  %D%/raster.c %D%/raster.h \
  %D%/shade.c %D%/shade.h %D%/vector.h
softshadow_SOURCES += \
  %D%/picture.c %D%/picture.h \
  %D%/render.c %D%/stage.c
