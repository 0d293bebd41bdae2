/* Points into one frame, as compiled for each rung. */
#ifndef SS_MAP_LOOK_H
#define SS_MAP_LOOK_H

#include "map/frame.h"

typedef void ss_look_single(const ss_frames *frames, const ss_places *places, size_t n,
                            ss_looks *out);
ss_look_single ss_look_single_scalar, ss_look_single_avx2, ss_look_single_avx512;

#endif
