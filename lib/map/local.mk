# Light-space frames, and what every map technique needs beside them.
libsoftshadow_core_la_SOURCES += \
  %D%/frame.c %D%/frame.h
