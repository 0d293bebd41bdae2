# Drawing into maps: one table of passes, and the CPU's.
libsoftshadow_core_la_SOURCES += \
  %D%/raster.h \
  %D%/casters.c %D%/casters.h \
  %D%/clip.c %D%/clip.h \
  %D%/setup.c %D%/setup.h \
  %D%/cpu/bins.c %D%/cpu/bins.h \
  %D%/cpu/keep.c %D%/cpu/keep.h \
  %D%/cpu/cpu.c \
  %D%/cpu/scan.c %D%/cpu/scan.h \
  %D%/cpu/setup.h \
  %D%/cpu/tile_kernel.h
# Compiled for each instruction set, in the libraries of base/local.mk.
libss_scalar_la_SOURCES += %D%/cpu/setup_scalar.c %D%/cpu/setup_kernel.h
if HAVE_X86
libss_avx2_la_SOURCES += %D%/cpu/setup_avx2.c
libss_avx512_la_SOURCES += %D%/cpu/setup_avx512.c
endif
# Loaded when it is asked for: only the types of libepoxy's headers are used.
AM_CPPFLAGS += $(EPOXY_CFLAGS)
libsoftshadow_core_la_SOURCES += \
  %D%/egl/ask.c %D%/egl/ask.h \
  %D%/egl/context.c %D%/egl/context.h \
  %D%/egl/depth.c \
  %D%/egl/egl.c \
  %D%/egl/gl.c %D%/egl/gl.h \
  %D%/egl/image.c \
  %D%/egl/keep.c \
  %D%/egl/loops.c \
  %D%/egl/passes.h \
  %D%/egl/thread.c %D%/egl/thread.h \
  %D%/egl/walk.c %D%/egl/walk.h
