# Drawing into maps: one table of passes, and the CPU's.
libsoftshadow_core_la_SOURCES += \
  %D%/raster.h \
  %D%/cpu/bins.c %D%/cpu/bins.h \
  %D%/cpu/clip.c %D%/cpu/clip.h \
  %D%/cpu/cpu.c \
  %D%/cpu/scan.c %D%/cpu/scan.h
