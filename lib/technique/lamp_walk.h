/* What stands before a lamp, summed over the texels of a kernel, as compiled for each rung. */
#ifndef SS_TECHNIQUE_LAMP_WALK_H
#define SS_TECHNIQUE_LAMP_WALK_H

#include "map/pyramid.h"
#include "technique/lamp.h"

/* One point and the face it looks at. */
typedef struct ss_lamp_asked {
    const ss_lamp_view *view;
    const ss_lamp_kernel *kernel;
    const ss_pyramid *pyramid; /* of the nearest depths */
    const float *texels;       /* patches: `layers` depths a texel, then as many to compare with */
    uint32_t layers;
    double x, y;
    float h;
} ss_lamp_asked;

#define SS_LAMP_NOTHING 1e-9 /* less of the light than this is rounding */

/* The mean h_p - h_v of what blocks some of the light; false: nothing does. */
typedef bool ss_lamp_blockers(const ss_lamp_asked *asked, double *mean);
/* The share of the lamp, as a gap makes it, that lies on such texels. */
typedef double ss_lamp_filter(const ss_lamp_asked *asked, double gap);
/* The share that patches hide, of each texel the deepest that hides any; 1 is the most. */
typedef double ss_lamp_patches(const ss_lamp_asked *asked);

ss_lamp_blockers ss_lamp_blockers_scalar, ss_lamp_blockers_avx2, ss_lamp_blockers_avx512;
ss_lamp_filter ss_lamp_filter_scalar, ss_lamp_filter_avx2, ss_lamp_filter_avx512;
ss_lamp_patches ss_lamp_patches_scalar, ss_lamp_patches_avx2, ss_lamp_patches_avx512;

#endif
