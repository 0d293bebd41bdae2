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
  %D%/vec.h
