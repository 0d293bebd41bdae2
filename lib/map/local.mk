# Light-space frames, and what every map technique needs beside them.
libsoftshadow_core_la_SOURCES += \
  %D%/falloff.c %D%/falloff.h \
  %D%/frame.c %D%/frame.h \
  %D%/pyramid.c %D%/pyramid.h
