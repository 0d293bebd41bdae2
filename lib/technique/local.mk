# One file per algorithm, listed in registry.c.
libsoftshadow_core_la_SOURCES += \
  %D%/answers.h \
  %D%/backprojection.c \
  %D%/blur.c %D%/blur.h \
  %D%/exact.c %D%/exact.h %D%/exact_parts.h %D%/exact_build.c %D%/exact_setup.c \
  %D%/four_texels.h \
  %D%/hard.c \
  %D%/lamp.c %D%/lamp.h %D%/lamp_ask.c %D%/lamp_ask.h %D%/lamp_glsl.h \
  %D%/light_maps.c %D%/light_maps.h \
  %D%/limit.h %D%/limit_propagate.c %D%/limit_ribbons.c \
  %D%/map_techniques.h \
  %D%/midpoint.c %D%/midpoint.h \
  %D%/outer.c %D%/outer.h \
  %D%/rim.c %D%/rim.h %D%/rim_draw.c \
  %D%/parts.c %D%/parts.h \
  %D%/pcf.c \
  %D%/pcss.c \
  %D%/penumbra_limit.c \
  %D%/penumbra_map.c \
  %D%/penumbra_mask.c \
  %D%/penumbra_volume.c \
  %D%/raytrace.c %D%/raytrace.h \
  %D%/registry.c %D%/technique.h \
  %D%/single_sample.c %D%/single_sample.h \
  %D%/smoothie.c
EXTRA_DIST += %D%/BIBLIOGRAPHY.md
# Compiled for each instruction set, in the libraries of base/local.mk.
libss_scalar_la_SOURCES += %D%/answers_scalar.c %D%/answers_kernel.h \
  %D%/offers_scalar.c %D%/offers_kernel.h %D%/offers.h \
  %D%/lamp_walk_scalar.c %D%/lamp_walk_kernel.h %D%/lamp_walk.h \
  %D%/midpoint_scalar.c %D%/midpoint_kernel.h
if HAVE_X86
libss_avx2_la_SOURCES += %D%/answers_avx2.c %D%/offers_avx2.c %D%/lamp_walk_avx2.c \
  %D%/midpoint_avx2.c
libss_avx512_la_SOURCES += %D%/answers_avx512.c %D%/offers_avx512.c %D%/lamp_walk_avx512.c \
  %D%/midpoint_avx512.c
endif
