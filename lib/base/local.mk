# Status and messages, memory, threads, cpu features, exact signs: what any library needs.
libsoftshadow_core_la_SOURCES += \
  %D%/clock.c %D%/clock.h \
  %D%/cpu.c %D%/cpu.h \
  %D%/fpu.c %D%/fpu.h \
  %D%/lanes.h \
  %D%/memory.c %D%/memory.h \
  %D%/parallel.c %D%/parallel.h \
  %D%/predicate.c %D%/predicate.h \
  %D%/process.c %D%/process.h \
  %D%/status.c %D%/status.h \
  %D%/vec.h \
  %D%/wide.h

# Kernels for each instruction set: libraries of their own, for their flags. Nothing in them but static
# inline C and what cpu.h chooses from.
noinst_LTLIBRARIES += libss_scalar.la
libss_scalar_la_SOURCES =
libss_scalar_la_CFLAGS = $(AM_CFLAGS) $(SS_OPTIMIZE_KERNELS) -fno-trapping-math
libsoftshadow_core_la_LIBADD += libss_scalar.la
if HAVE_X86
noinst_LTLIBRARIES += libss_avx2.la libss_avx512.la
libss_avx2_la_SOURCES =
libss_avx2_la_CFLAGS = $(AM_CFLAGS) $(SS_OPTIMIZE_KERNELS) -mavx2 -mfma -mbmi -mpopcnt
libss_avx512_la_SOURCES =
libss_avx512_la_CFLAGS = $(AM_CFLAGS) $(SS_OPTIMIZE_KERNELS) -mavx512f -mavx512bw -mavx512dq -mavx512vl -mavx2 -mfma \
  -mbmi -mpopcnt
libsoftshadow_core_la_LIBADD += libss_avx2.la libss_avx512.la
endif
