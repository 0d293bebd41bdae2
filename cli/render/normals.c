/* normals.c */
#include "normals.h"

#include <stdlib.h>

static const double crease_cosine = 0.7660444431189780; /* of 40 degrees */

static vector face_normal(const raster_surface *surface, size_t triangle) {
    const uint32_t *i = surface->indices + 3 * triangle;
    const vector a = vector_of(surface->positions + 3 * (size_t)i[0]);
    const vector b = vector_of(surface->positions + 3 * (size_t)i[1]);
    const vector c = vector_of(surface->positions + 3 * (size_t)i[2]);
    return vector_cross(vector_sub(b, a), vector_sub(c, a));
}

/* Counts the faces at each vertex, then lists them: a counting sort by vertex. */
static bool list_around(facing *out, const raster_surface *surface) {
    const size_t corners = 3 * surface->triangle_count;
    out->first = calloc(surface->vertex_count + 2, sizeof *out->first);
    out->around = malloc((corners + 1) * sizeof *out->around);
    if (!out->first || !out->around) return false;
    size_t *next = out->first + 1; /* next[v] is where v's list goes on, and in the end its end */
    for (size_t i = 0; i < corners; i++) next[surface->indices[i] + 1]++;
    for (size_t v = 0; v < surface->vertex_count; v++) next[v + 1] += next[v];
    for (size_t i = 0; i < corners; i++)
        out->around[next[surface->indices[i]]++] = (uint32_t)(i / 3);
    return true;
}

bool normals_make(facing *out, const raster_surface *surface, bool smooth) {
    *out = (facing){0};
    out->faces = malloc((surface->triangle_count + 1) * sizeof *out->faces);
    if (!out->faces) return false;
    for (size_t t = 0; t < surface->triangle_count; t++) out->faces[t] = face_normal(surface, t);
    return !smooth || list_around(out, surface);
}

void normals_free(facing *normals) {
    free(normals->faces);
    free(normals->around);
    free(normals->first);
}

vector normals_flat(const facing *normals, uint32_t triangle) {
    return vector_unit(normals->faces[triangle]);
}

static vector at_corner(const facing *normals, uint32_t vertex, vector face) {
    vector sum = {0, 0, 0};
    const double length = vector_length(face);
    for (size_t i = normals->first[vertex]; i < normals->first[vertex + 1]; i++) {
        const vector other = normals->faces[normals->around[i]];
        if (vector_dot(other, face) >= crease_cosine * length * vector_length(other))
            sum = vector_add(sum, other);
    }
    return vector_unit(sum);
}

vector normals_smooth(const facing *normals, const raster_surface *surface, uint32_t triangle,
                      const double weight[3]) {
    const vector face = normals->faces[triangle];
    vector sum = {0, 0, 0};
    for (int i = 0; i < 3; i++) {
        const uint32_t vertex = surface->indices[3 * (size_t)triangle + (size_t)i];
        sum = vector_add(sum, vector_scale(at_corner(normals, vertex, face), weight[i]));
    }
    const vector unit = vector_unit(sum);
    return vector_length(unit) > 0.5 ? unit : vector_unit(face);
}
