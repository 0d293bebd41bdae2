# Light-space frames, and what every map technique needs beside them.
libsoftshadow_core_la_SOURCES += \
  %D%/falloff.c %D%/falloff.h \
  %D%/frame.c %D%/frame.h \
  %D%/look.h \
  %D%/pyramid.c %D%/pyramid.h
# Compiled for each instruction set, in the libraries of base/local.mk.
libss_scalar_la_SOURCES += %D%/look_scalar.c %D%/look_kernel.h
if HAVE_X86
libss_avx2_la_SOURCES += %D%/look_avx2.c
libss_avx512_la_SOURCES += %D%/look_avx512.c
endif
