# The handle; what to build and what to skip; the loop over a batch of points.
libsoftshadow_core_la_SOURCES += \
  %D%/build.c %D%/engine.h \
  %D%/device.c %D%/device.h \
  %D%/error.c %D%/explain.c %D%/inspect.c \
  %D%/lend.c \
  %D%/order.c %D%/order.h \
  %D%/places.c %D%/places.h \
  %D%/plan.c %D%/plan.h \
  %D%/query.c \
  %D%/settle.c %D%/settle.h
# Compiled for each instruction set, in the libraries of base/local.mk.
libss_scalar_la_SOURCES += %D%/places_scalar.c %D%/places_kernel.h
if HAVE_X86
libss_avx2_la_SOURCES += %D%/places_avx2.c
libss_avx512_la_SOURCES += %D%/places_avx512.c
endif
