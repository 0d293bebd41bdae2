# What hides the light: samples, and kernels for each instruction set. Those are libraries of their own,
# for their flags; nothing in them but static inline C and one entry.
libsoftshadow_core_la_SOURCES += \
  %D%/bound.c %D%/bound.h \
  %D%/direct.c %D%/direct.h \
  %D%/floor.c %D%/floor.h \
  %D%/group.c %D%/group.h %D%/group_kernel.h %D%/kernel_draw.h %D%/kernel_edge.h %D%/kernel_test.h \
  %D%/kernel_view.h \
  %D%/lattice.c %D%/lattice.h \
  %D%/slab.c %D%/slab.h \
  %D%/view.c %D%/view.h
noinst_LTLIBRARIES += libss_scalar.la
libss_scalar_la_SOURCES = %D%/group_scalar.c %D%/lanes_scalar.h
libss_scalar_la_CFLAGS = $(AM_CFLAGS) -O3 -fno-trapping-math
libsoftshadow_core_la_LIBADD += libss_scalar.la
EXTRA_DIST += %D%/lanes_avx2.h %D%/lanes_avx512.h
if HAVE_X86
noinst_LTLIBRARIES += libss_avx2.la libss_avx512.la
libss_avx2_la_SOURCES = %D%/group_avx2.c
libss_avx2_la_CFLAGS = $(AM_CFLAGS) -O3 -mavx2 -mfma -mbmi -mpopcnt
libss_avx512_la_SOURCES = %D%/group_avx512.c
libss_avx512_la_CFLAGS = $(AM_CFLAGS) -O3 -mavx512f -mavx512bw -mavx512dq -mavx512vl -mavx2 -mfma \
  -mbmi -mpopcnt
libsoftshadow_core_la_LIBADD += libss_avx2.la libss_avx512.la
endif
