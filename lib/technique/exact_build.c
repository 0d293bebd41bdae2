/* What exact.c builds for a light: its samples, and the casters' outlines. */
#include <math.h>
#include <string.h>

#include "base/status.h"
#include "base/vec.h"
#include "technique/exact_parts.h"

/* As many as fill the smallest grid that keeps a tolerance of 1/256: more would cost twice as much.
 */
#define DEFAULT_DISK 768
#define DEFAULT_RECT 528

/* Floats are summed in an order of axes that turns with the scene: bits then do not depend on how
 * the scene's axes are named. The first vertex that tells two axes apart decides, else the light.
 */
static int compare_axes(const ss_world *world, const ss_light *light, int a, int b) {
    for (size_t v = 0; v < world->vertex_count; v++) {
        const float x = world->vertices[3 * v + (size_t)a], y = world->vertices[3 * v + (size_t)b];
        if (x != y) return x < y ? -1 : 1;
    }
    const double *const vectors[] = {light->centre, light->normal, light->u, light->v};
    for (int i = 0; i < 4; i++) {
        if (vectors[i][a] != vectors[i][b]) return vectors[i][a] < vectors[i][b] ? -1 : 1;
    }
    return 0;
}

static void order_axes(const ss_world *world, const ss_light *light, uint8_t axis[3]) {
    for (int k = 0; k < 3; k++) axis[k] = (uint8_t)k;
    for (int i = 1; i < 3; i++) {
        for (int j = i; j > 0 && compare_axes(world, light, axis[j], axis[j - 1]) < 0; j--) {
            const uint8_t swap = axis[j];
            axis[j] = axis[j - 1], axis[j - 1] = swap;
        }
    }
}

void ss_exact_turn(const uint8_t axis[3], const double in[3], double out[3]) {
    for (int k = 0; k < 3; k++) out[k] = in[axis[k]];
}

static void turn_light(const uint8_t axis[3], const ss_light *in, ss_light *out) {
    *out = *in;
    ss_exact_turn(axis, in->centre, out->centre);
    ss_exact_turn(axis, in->normal, out->normal);
    ss_exact_turn(axis, in->u, out->u);
    ss_exact_turn(axis, in->v, out->v);
}

static bool mark_tested(const ss_world *world, uint8_t **tested) {
    if (!world->any_opacity) return true;
    *tested = ss_alloc(world->triangle_count, 1);
    for (uint32_t m = 0; m < world->mesh_count && *tested; m++) {
        const ss_world_mesh *mesh = &world->meshes[m];
        if (!mesh->source->opacity.texels) continue;
        memset(*tested + mesh->first_triangle, 1, mesh->source->triangle_count);
    }
    return *tested != NULL;
}

void ss_exact_destroy(void *state) {
    exact *e = state;
    if (!e) return;
    for (unsigned i = 0; i < e->steps; i++) ss_lattice_destroy(e->step[i]);
    ss_outline_destroy(e->outline);
    ss_free(e->tested);
    ss_free(e->plates);
    ss_free(e);
}

/* Errors grow with the root of the samples along rims. At 1/256, where 144 of 768 may differ from a
 * neighbour, foliage under a medium light has an RMS error of .0028, seven tenths of the tolerance;
 * 81 of them made it .0020 and took half as long again. */
#define ROUGH 4.0

/* After all samples a point with more takes so many times as many. */
#define MORE 3

static softshadow_status add_step(exact *e, const ss_stage *stage, const ss_light *shape,
                                  uint32_t samples) {
    const double root = ROUGH * stage->params->tolerance * samples;
    e->rough[e->steps] = (uint32_t)fmin(root * root, UINT32_MAX);
    const softshadow_status status = ss_lattice_create(&e->step[e->steps], shape, samples);
    if (!status) e->steps++;
    return status;
}

/* Fewer samples than fill the smallest grid would cost the same, a third of a grid of two blocks
 * saves nothing. Holes of textures are finer than any sample. */
static softshadow_status make_steps(exact *e, const ss_stage *stage, const ss_light *shape,
                                    uint32_t samples, uint32_t usual) {
    uint32_t few = stage->params->few;
    const bool steps = few && !stage->world->any_opacity;
    if (few < usual) few = usual;
    softshadow_status status = SOFTSHADOW_OK;
    if (steps && few < samples) status = add_step(e, stage, shape, few);
    if (!status) status = add_step(e, stage, shape, samples);
    if (status) return status;
    e->usual = e->steps - 1;
    if (e->usual && e->step[e->usual]->blocks == 2) {
        ss_lattice_destroy(e->step[0]);
        e->step[0] = e->step[1], e->rough[0] = e->rough[1];
        e->usual = 0, e->steps = 1;
    }
    if (!steps || samples > SS_LATTICE_MOST / MORE) return SOFTSHADOW_OK;
    return add_step(e, stage, shape, MORE * samples);
}

static softshadow_status count_culled(exact *e, const ss_stage *stage) {
    const size_t all = stage->world->triangle_count;
    double low[3], high[3];
    if (!stage->params->bounded || !all) return SOFTSHADOW_OK;
    uint32_t *left = ss_alloc(all, sizeof *left);
    if (!left) return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    for (int k = 0; k < 3; k++) { /* points are put onto what they touch */
        low[k] = stage->params->bounds[k] - SS_NEAR,
        high[k] = stage->params->bounds[3 + k] + SS_NEAR;
    }
    e->culled = all - ss_bvh_shaft(stage->bvh, stage->light, low, high, left, all);
    ss_free(left);
    return SOFTSHADOW_OK;
}

/* How wrong a closed form says it may be, in tolerances. It reckons with the worst of all its
 * roundings: on 2,600 random points the largest error was an 80th of that, the RMS error a 500th,
 * so that 16 keep a twentieth of the tolerance. No more than MOST_CLOSED, where drawing certifies
 * as much. With samples given by the caller it only tells what is lit, which drawing could not tell
 * otherwise. */
#define CLOSED      16.0f
#define MOST_CLOSED 0x1p-6f

static softshadow_status make_plates(exact *e, const ss_stage *stage) {
    if (stage->params->weighting != SOFTSHADOW_UNIFORM) return SOFTSHADOW_OK;
    const float most = fminf(CLOSED * (float)stage->params->tolerance, MOST_CLOSED);
    e->plates_most = stage->params->few ? most : 0;
    return ss_plates_create(&e->plates, stage->world, &e->light, e->axis);
}

const ss_plates *ss_exact_plates(const void *state, float *most) {
    const exact *e = state;
    *most = e->plates_most;
    return e->plates;
}

uint64_t ss_exact_culled(const void *state) { return ((const exact *)state)->culled; }

softshadow_status ss_exact_build(const ss_stage *stage, void **state) {
    exact *e = ss_alloc(1, sizeof *e);
    if (!e || !mark_tested(stage->world, &e->tested)) {
        ss_exact_destroy(e);
        return ss_fail(SOFTSHADOW_E_MEMORY, "exact: out of memory");
    }
    e->kernel = ss_group_kernels_here();
    order_axes(stage->world, stage->light, e->axis);
    turn_light(e->axis, stage->light, &e->light);
    /* Other weightings reckon with the profile themselves. */
    ss_light shape = *stage->light;
    if (stage->params->weighting != SOFTSHADOW_UNIFORM) shape.profile_count = 0;
    const uint32_t usual = stage->light->type == SOFTSHADOW_RECT ? DEFAULT_RECT : DEFAULT_DISK;
    uint32_t samples = stage->params->samples ? stage->params->samples : usual;
    if (!stage->params->samples && stage->params->tolerance < 1.0 / 256) {
        /* The error of a lattice falls with the samples to the power of -3/4. */
        const double more = pow(1.0 / 256 / stage->params->tolerance, 4.0 / 3);
        samples = (uint32_t)fmin(usual * more, SS_LATTICE_MOST);
    }
    softshadow_status status = make_steps(e, stage, &shape, samples, usual);
    if (!status) status = count_culled(e, stage);
    if (!status) status = make_plates(e, stage);
    if (!status) {
        status = ss_outline_build(&e->outline, stage->bvh, stage->topology, e->tested, stage->light,
                                  stage->pool);
    }
    if (status)
        ss_exact_destroy(e);
    else
        *state = e;
    return status;
}

size_t ss_exact_bytes(const void *state) {
    const exact *e = state;
    size_t sum = sizeof *e + ss_outline_bytes(e->outline);
    if (e->plates) sum += sizeof *e->plates;
    for (unsigned i = 0; i < e->steps; i++) sum += ss_lattice_bytes(e->step[i]);
    return sum;
}
