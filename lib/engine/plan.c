#include "engine/plan.h"

#include <stdio.h>
#include <string.h>

#include "base/cpu.h"
#include "base/process.h"
#include "base/status.h"
#include "base/vec.h"
#include "technique/blur.h"

#define MOST_RESOLUTION 16384u
#define MOST_TAPS 64u

static softshadow_status check_range(const char *field, uint32_t value, uint32_t most) {
    if (value <= most) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_ARGUMENT, "build.%s: %u, must be 0..%u", field, value, most);
}

static softshadow_status check_number(const char *field, double value, double most) {
    if (value >= 0 && value <= most) return SOFTSHADOW_OK;
    return ss_fail(SOFTSHADOW_E_ARGUMENT, "build.%s: %g, must be 0..%g", field, value, most);
}

static softshadow_status check_bounds(const double *bounds) {
    for (int k = 0; k < 3 && bounds; k++) {
        if (bounds[k] <= bounds[3 + k] && isfinite(bounds[k]) && isfinite(bounds[3 + k])) continue;
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "build.bounds: %g..%g along axis %d, must be finite, lowest first",
                       bounds[k], bounds[3 + k], k);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status check_request(const softshadow_build *request) {
    const struct {
        const char *field;
        uint32_t value, most;
    } whole[] = {{"backend", request->backend, SOFTSHADOW_ANY},
                 {"samples", request->samples, SS_MOST_SAMPLES},
                 {"max_samples", request->max_samples, SS_MOST_SAMPLES},
                 {"resolution", request->resolution, MOST_RESOLUTION},
                 {"layers", request->layers, SS_MOST_LAYERS},
                 {"falloff", request->falloff, SOFTSHADOW_FALLOFF_PROFILE},
                 {"weighting", request->weighting, SOFTSHADOW_IRRADIANCE},
                 {"mask_taps", request->mask_taps, MOST_TAPS},
                 {"blur", request->blur, SS_MOST_BLUR},
                 {"sub_lights", request->sub_lights, SS_MOST_SUB_LIGHTS}};
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++) {
        const softshadow_status status =
            check_range(whole[i].field, whole[i].value, whole[i].most);
        if (status) return status;
    }
    softshadow_status status = check_number("tolerance", request->tolerance, 1);
    if (!status) status = check_number("depth_bias", request->depth_bias, SS_COORDINATE_LIMIT);
    if (!status) status = check_number("smoothie_width", request->smoothie_width, 1e6);
    return status ? status : check_bounds(request->bounds);
}

/* What "auto" stands for: the noise-free engine at as many samples as the tolerance needs, with
 * coarser levels of dense meshes where they are repaid (SS_NEEDS_LOD), and where they are not with
 * rays for those groups of points that rays answer faster. */
#define AUTO "exact"
/* Foliage of 2,000 leaves under a light of its own size has an RMS error of .0111 at 256 samples,
 * .0044 at 1024 and .0017 at 4096 (softshadow bench --scenes leaves-2k --lights object); .0120
 * leaves a margin. What is denser takes the technique's next step. */
#define WORST_ERROR 0.0120
#define WORST_SLOPE 1.47
#define AT_WORST 256
/* 20k leaves have .0174 at 256 samples; 384 cost a tenth more there and nothing elsewhere. */
#define AUTO_LEAST 384
/* Where few edges cross the light a third of the samples is enough, where very many do the
 * technique takes more. */
#define FEWER 3
#define AUTO_MOST 65536

static uint32_t samples_for(double tolerance) {
    const double samples = AT_WORST * pow(WORST_ERROR / tolerance, WORST_SLOPE);
    return (uint32_t)fmin(fmax(ceil(samples), AUTO_LEAST), AUTO_MOST);
}

static bool is_auto(const char *name) { return strcmp(name, "auto") == 0; }

uint32_t ss_plan_method_count(void) { return ss_technique_count + 1; }

bool ss_plan_method(uint32_t index, softshadow_method *method) {
    if (index > ss_technique_count) return false;
    const ss_technique *technique =
        index ? ss_techniques[index - 1] : ss_technique_find(AUTO);
    method->name = technique->name, method->title = technique->title;
    method->citation = technique->cite, method->notes = technique->notes;
    method->bound_kind = technique->bound_kind;
    method->lights_native = technique->lights_native;
    method->lights_approximated = technique->lights_approximated;
    method->backends = 1u << SOFTSHADOW_CPU | (technique->query_glsl ? 1u << SOFTSHADOW_EGL : 0);
    if (index) return true;
    method->name = "auto";
    method->title = "What meets the tolerance asked for in the least time (the default)";
    method->notes =
        "samples as the tolerance needs; coarser levels of dense meshes where they repay "
        "their making, else rays for what takes longer, unless bounds are asked for";
    return true;
}

static softshadow_status find_technique(const char *name, const ss_technique **out) {
    char names[SS_MESSAGE_SIZE] = "auto";
    *out = ss_technique_find(is_auto(name) ? AUTO : name);
    if (*out) return SOFTSHADOW_OK;
    for (uint32_t i = 0; i < ss_technique_count; i++) {
        const size_t used = strlen(names);
        snprintf(names + used, sizeof names - used, ", %s", ss_techniques[i]->name);
    }
    return ss_fail(SOFTSHADOW_E_UNSUPPORTED, "build.method: \"%.40s\", this library has %s", name,
                   names);
}

static softshadow_status check_lights(const ss_technique *technique, const ss_scene *scene) {
    static const char *const type[] = {"SPHERE", "DISK", "RECT", "SUN"};
    for (uint32_t i = 0; i < scene->light_count; i++) {
        const uint32_t bit = 1u << scene->lights[i].type;
        if ((technique->lights_native | technique->lights_approximated) & bit) continue;
        return ss_fail(SOFTSHADOW_E_UNSUPPORTED, "build.method: \"%s\" cannot do light %u, a %s",
                       technique->name, i, type[scene->lights[i].type]);
    }
    return SOFTSHADOW_OK;
}

static softshadow_status open_gpu(const ss_technique *technique) {
    ss_raster_device device;
    if (technique->query_glsl) return ss_raster_egl.open(&device);
    return ss_fail(SOFTSHADOW_E_UNSUPPORTED,
                   "build.backend: SOFTSHADOW_EGL, method \"%s\" runs on SOFTSHADOW_CPU only",
                   technique->name);
}

static softshadow_status choose_backend(ss_plan *plan, uint32_t backend) {
    plan->raster = &ss_raster_cpu, plan->any = backend == SOFTSHADOW_ANY;
    if (backend == SOFTSHADOW_CPU) return SOFTSHADOW_OK;
    const softshadow_status status = open_gpu(plan->technique);
    if (!status) plan->raster = &ss_raster_egl;
    else if (plan->any) ss_plan_spare(plan);
    return plan->any ? SOFTSHADOW_OK : status;
}

void ss_plan_spare(ss_plan *plan) {
    plan->raster = &ss_raster_cpu;
    snprintf(plan->why, sizeof plan->why, "%s", ss_message());
    ss_message_clear();
}

softshadow_status ss_plan_backend(uint32_t backend, const char **name, ss_raster_device *device) {
    static const ss_raster *const all[] = {[SOFTSHADOW_CPU] = &ss_raster_cpu,
                                           [SOFTSHADOW_EGL] = &ss_raster_egl};
    *device = (ss_raster_device){"", ""};
    *name = "";
    if (backend >= sizeof all / sizeof *all) {
        return ss_fail(SOFTSHADOW_E_ARGUMENT,
                       "backend: %u, must be SOFTSHADOW_CPU or SOFTSHADOW_EGL", backend);
    }
    *name = all[backend]->name;
    if (all[backend]->open) return all[backend]->open(device);
    snprintf(device->name, sizeof device->name, "%s", ss_rung_name(ss_cpu_rung()));
    return SOFTSHADOW_OK;
}

static uint32_t or_default(uint32_t value, uint32_t otherwise) { return value ? value : otherwise; }

static void fill_params(ss_params *params, const softshadow_build *request) {
    *params = (ss_params){
        .samples = request->samples,
        .resolution = or_default(request->resolution, 1024),
        .layers = or_default(request->layers, 3),
        .max_samples = request->max_samples,
        .falloff = request->falloff,
        .weighting = request->weighting,
        .mask_taps = or_default(request->mask_taps, 8),
        .blur = request->blur,
        .seed = request->seed,
        .propagate = request->propagate != 0,
        .tolerance = request->tolerance > 0 ? request->tolerance : 1.0 / 256,
        .depth_bias = request->depth_bias,
        .smoothie_width = request->smoothie_width,
        .points_ahead = request->points_ahead,
        .sub_lights = or_default(request->sub_lights, 1),
        .bounded = request->bounds != NULL,
    };
    if (request->bounds) memcpy(params->bounds, request->bounds, sizeof params->bounds);
}

static bool casts_anything(const ss_scene *scene) {
    for (uint32_t i = 0; i < scene->mesh_count; i++) {
        const ss_mesh *mesh = &scene->meshes[i];
        if (mesh->used && (mesh->flags & SOFTSHADOW_CASTS) && mesh->triangle_count) return true;
    }
    return false;
}

softshadow_status ss_plan_make(ss_plan *plan, const softshadow_build *request,
                               const ss_scene *scene) {
    *plan = (ss_plan){0};
    if (scene->light_count == 0) {
        return ss_fail(SOFTSHADOW_E_STATE, "there is no light: call softshadow_set_light() first");
    }
    softshadow_status status = check_request(request);
    const char *method = request->method ? request->method : "auto";
    if (!status) status = find_technique(method, &plan->technique);
    if (!status) status = check_lights(plan->technique, scene);
    if (status) return status;
    const uint32_t weighting = request->weighting;
    if (!(plan->technique->weightings >> weighting & 1)) {
        return ss_fail(SOFTSHADOW_E_UNSUPPORTED, "build.weighting: %u, method \"%s\" cannot do it",
                       weighting, plan->technique->name);
    }
    fill_params(&plan->params, request);
    if (is_auto(method) && !plan->params.samples) {
        plan->params.samples = samples_for(plan->params.tolerance);
        plan->params.few = plan->params.samples / FEWER;
    }
    plan->needs = plan->technique->needs;
    if (plan->params.propagate) plan->needs &= ~plan->technique->spared;
    if (is_auto(method)) plan->needs |= SS_NEEDS_LOD;
    if (!casts_anything(scene)) plan->needs &= ~(uint32_t)SS_NEEDS_RAYS; /* nothing to hit */
    if ((plan->needs & SS_NEEDS_RAYS) && ss_process_forked()) {
        return ss_fail(SOFTSHADOW_E_UNSUPPORTED,
                       "build.method: \"%s\" traces rays, which cannot be promised after fork()",
                       plan->technique->name);
    }
    return choose_backend(plan, request->backend);
}
