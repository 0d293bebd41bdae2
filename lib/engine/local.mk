# The handle; what to build and what to skip; the loop over a batch of points.
libsoftshadow_core_la_SOURCES += \
  %D%/build.c %D%/engine.h \
  %D%/device.c %D%/device.h \
  %D%/error.c %D%/explain.c %D%/inspect.c \
  %D%/lend.c \
  %D%/order.c %D%/order.h \
  %D%/plan.c %D%/plan.h \
  %D%/query.c \
  %D%/settle.c %D%/settle.h
