# One file per algorithm, listed in registry.c.
libsoftshadow_core_la_SOURCES += \
  %D%/exact.c %D%/exact.h \
  %D%/raytrace.c %D%/raytrace.h \
  %D%/registry.c %D%/technique.h
EXTRA_DIST += %D%/BIBLIOGRAPHY.md
