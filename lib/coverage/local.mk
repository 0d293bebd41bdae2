# What hides the light: samples, and kernels for each instruction set.
libsoftshadow_core_la_SOURCES += \
  %D%/bound.c %D%/bound.h \
  %D%/direct.c %D%/direct.h \
  %D%/floor.c %D%/floor.h \
  %D%/group.c %D%/group.h %D%/group_kernel.h %D%/kernel_draw.h %D%/kernel_edge.h %D%/kernel_test.h \
  %D%/kernel_view.h \
  %D%/sky.c %D%/sky.h %D%/sky_parts.h %D%/umbra.c \
  %D%/lattice.c %D%/lattice.h \
  %D%/plates.c %D%/plates.h \
  %D%/slab.c %D%/slab.h \
  %D%/view.c %D%/view.h
libss_scalar_la_SOURCES += %D%/group_scalar.c %D%/fma_once.h %D%/lanes_scalar.h %D%/lanes_sse2.h \
  %D%/sky_scalar.c %D%/sky_kernel.h \
  %D%/plates_scalar.c %D%/plates_kernel.h
EXTRA_DIST += %D%/lanes_avx2.h %D%/lanes_avx512.h
if HAVE_X86
libss_avx2_la_SOURCES += %D%/group_avx2.c %D%/sky_avx2.c %D%/plates_avx2.c
libss_avx512_la_SOURCES += %D%/group_avx512.c %D%/sky_avx512.c %D%/plates_avx512.c
endif
