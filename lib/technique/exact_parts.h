/* The parts of exact.c: what a build makes, what a query works with, and what its files ask of each
 * other. */
#ifndef SS_TECHNIQUE_EXACT_PARTS_H
#define SS_TECHNIQUE_EXACT_PARTS_H

#include "coverage/direct.h"
#include "coverage/group.h"
#include "coverage/plates.h"
#include "technique/technique.h"
#include "trace/contact.h"

/* How many samples: as many as asked for, and under a tolerance also fewer, which are tried first,
 * and more, where the light's outline is cut into the most pieces. */
#define SS_EXACT_STEPS 3

typedef struct exact {
    ss_lattice *step[SS_EXACT_STEPS]; /* from few samples to many */
    /* What a step may leave: neighbours of which one is seen and the other not, which is how far
     * the outline is cut. Points with more of them take the next step. */
    uint32_t rough[SS_EXACT_STEPS];
    unsigned steps, usual;            /* how many there are; the one of the samples asked for */
    ss_outline *outline;
    ss_light light; /* with its axes in summing order */
    uint8_t axis[3];
    uint64_t culled; /* casters beside all segments from the build's bounds to the light */
    uint8_t *tested; /* per triangle: has an opacity texture; NULL if none has */
    const ss_group_kernel *kernel;
    ss_plates *plates; /* what tells points without drawing; or NULL */
    float plates_most; /* see ss_plates_tell */
} exact;

/* What one query works with. */
typedef struct scratch {
    const ss_stage *stage;
    const exact *state;
    ss_arena *arena;
    ss_group *group;
    ss_contact *contact; /* per lane */
    ss_contact_face *faces;
    const ss_point *points; /* of the query */
    double (*boxes)[6];     /* of each SS_LANES of them, lowest corner first */
    ss_group_views *views;
    ss_view *view; /* per lane, axes in summing order; see ss_exact_view() */
    uint32_t *skip;
    uint16_t *skip_lanes;
    uint32_t *marks; /* of a lane, or all of them: see ss_group */
    double reach;    /* of the group: see ss_group_kernel */
    size_t clear;    /* of the group's planes: no more of them are set to zero than a step needs */
    bool together;   /* bounds are found for groups: faster, but company changes them */
    ss_direct *direct;
    uint32_t *triangles;
    size_t direct_room;
    double size;      /* largest coordinate of the casters as the host gave them, local units */
    uint64_t settled; /* points answered by whole groups */
    bool in_dark;     /* all of the last group's points see nothing: of the next group, too? */
    uint32_t unlit;   /* groups since the last that was lit, as far as they were looked at */
    /* Groups of each step, and those of them of which some took the next. */
    uint32_t tried[SS_EXACT_STEPS], failed[SS_EXACT_STEPS];
    uint32_t last;        /* what the last group took, by ss_group_took(), ... */
    uint32_t rays_take;   /* ... and rays would, each group of points; 0: there are none */
    uint64_t traced, rays;
    double stray;    /* how far beside the casters a coarser scene may be seen: half-widths of the
                        light */
    bool may_settle; /* seeing all of the light makes 1, whatever its parts weigh */
} scratch;

static inline const ss_lattice *ss_exact_usual(const exact *e) { return e->step[e->usual]; }
/* The most blocks of any step. */
static inline size_t ss_exact_blocks(const exact *e) { return e->step[e->steps - 1]->blocks; }

/* exact_build.c: the technique's slots. */
softshadow_status ss_exact_build(const ss_stage *stage, void **state);
void ss_exact_destroy(void *state);
size_t ss_exact_bytes(const void *state);
uint64_t ss_exact_culled(const void *state);
const ss_plates *ss_exact_plates(const void *state, float *most);
/* From the world's axes to summing order. */
void ss_exact_turn(const uint8_t axis[3], const double in[3], double out[3]);

/* exact_setup.c. False: out of memory. */
bool ss_exact_prepare(scratch *s, const ss_stage *stage, const exact *e, ss_arena *arena);
bool ss_exact_room(scratch *s, size_t count);
/* For the group's lattice. */
void ss_exact_clear_planes(scratch *s);
/* Finds the boxes of a query's points. False: out of memory. */
bool ss_exact_measure(scratch *s, const ss_point *points, size_t n);
/* Are they lit for sure? Encloses the points, too; for a group that is what is drawn next. *frame:
 * of the points around them, or NULL; becomes that for the parts of these. */
bool ss_exact_settles(scratch *s, const ss_point *points, size_t n, ss_shaft_frame *own,
                      const ss_shaft_frame **frame);
/* Finds the contacts and views of a group that is enclosed, and makes room for what moved. The
 * group's lanes become those that the kernels can draw. */
void ss_exact_set_up(scratch *s, const ss_point *points, unsigned n);
/* Fills s->view[lane]. */
void ss_exact_view(scratch *s, unsigned lane);

#endif
