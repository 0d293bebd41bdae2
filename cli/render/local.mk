# render: a rasteriser for first hits, the library for visibility. All but the command itself is in
# the archive: plugins/oiio makes the same pictures from the same scene files.
libcli_la_SOURCES += \
  %D%/camera.c %D%/camera.h \
  %D%/normals.c %D%/normals.h \
  %D%/picture.c %D%/picture.h %D%/stage.c \
  %D%/planes.c %D%/planes.h \
  %D%/raster.c %D%/raster.h \
  %D%/request.c %D%/request.h \
  %D%/shade.c %D%/shade.h %D%/vector.h \
  %D%/still.c %D%/still.h
softshadow_SOURCES += %D%/render.c
