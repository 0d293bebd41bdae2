/* What answers a block of looks from maps, as compiled for each rung. */
#ifndef SS_TECHNIQUE_ANSWERS_H
#define SS_TECHNIQUE_ANSWERS_H

#include "technique/light_maps.h"

ss_light_maps_answer ss_answer_hard_scalar, ss_answer_hard_avx2, ss_answer_hard_avx512;
ss_light_maps_answer ss_answer_tent_scalar, ss_answer_tent_avx2, ss_answer_tent_avx512;
ss_light_maps_answer ss_answer_single_scalar, ss_answer_single_avx2, ss_answer_single_avx512;
ss_light_maps_answer ss_answer_outer_scalar, ss_answer_outer_avx2, ss_answer_outer_avx512;
ss_light_maps_answer ss_answer_limit_scalar, ss_answer_limit_avx2, ss_answer_limit_avx512;

#endif
