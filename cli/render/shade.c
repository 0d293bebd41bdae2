/* shade.c */
#include "shade.h"

/* A light seen from a point: where its centre is, how far, how wide. */
typedef struct sight {
    vector towards;        /* unit */
    double distance, sine; /* of its angular radius */
    double strength;       /* how much of its power comes this way */
} sight;

/* The radius of the disk of a light's area. */
static double radius_of(const softshadow_light *light) {
    if (light->type != SOFTSHADOW_RECT) return light->radius;
    return 2 * sqrt(vector_length(vector_of(light->u)) * vector_length(vector_of(light->v)) / M_PI);
}

/* A flat light is dimmer from the side; under IRRADIANCE it has a dark back. */
static double emitted(const softshadow_light *light, uint32_t weighting, vector towards) {
    vector normal = vector_of(light->direction);
    if (light->type == SOFTSHADOW_RECT)
        normal = vector_cross(vector_of(light->u), vector_of(light->v));
    const double cosine = -vector_dot(vector_unit(normal), towards);
    return weighting == SOFTSHADOW_IRRADIANCE ? fmax(cosine, 0) : fabs(cosine);
}

static sight see(const softshadow_light *light, uint32_t weighting, vector reference,
                 vector point) {
    if (light->type == SOFTSHADOW_SUN) {
        const vector towards = vector_unit(vector_scale(vector_of(light->direction), -1));
        return (sight){towards, INFINITY, sin(light->radius), 1};
    }
    const vector to = vector_sub(vector_of(light->position), point);
    const double radius = radius_of(light), distance = vector_length(to);
    const double ideal = vector_length(vector_sub(vector_of(light->position), reference));
    sight s = {vector_unit(to), distance, distance > radius ? radius / distance : 1, 0};
    if (light->type == SOFTSHADOW_SPHERE) {
        /* Inside the lamp and at its very centre there is no more than at its surface. */
        const double near = fmax(distance, radius), far = fmax(ideal, radius);
        s.strength = near > 0 ? far * far / (near * near) : 1;
    } else { /* on its axis a disk gives r^2 / (d^2 + r^2) */
        const double near = distance * distance + radius * radius;
        s.strength = near > 0 ? (ideal * ideal + radius * radius) / near : 1;
        s.strength *= emitted(light, weighting, s.towards);
    }
    return s;
}

double shade_irradiance(const softshadow_light *light, uint32_t weighting, vector reference,
                        vector point, vector normal, double visibility) {
    const sight s = see(light, weighting, reference, point);
    const double cosine = vector_dot(s.towards, normal);
    if (!(cosine > -s.sine) || !(visibility > 0)) return 0;
    double mean = cosine;
    if (cosine < s.sine) {
        /* The horizon cuts the light: what is above it, (c + s) / 2s of it, has the mean cosine
         * (c + s) / 2. Only irradiance-weighted visibility leaves the cut to us: it is a ratio to
         * what is above; the others count what is below as hidden. */
        mean = (cosine + s.sine) / 2;
        if (weighting == SOFTSHADOW_IRRADIANCE) mean *= (cosine + s.sine) / (2 * s.sine);
    }
    return mean * s.strength * visibility;
}

float shade_srgb(float linear) {
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 1;
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * powf(linear, 1 / 2.4f) - 0.055f;
}
