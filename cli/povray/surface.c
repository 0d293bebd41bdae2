/* surface.c - a surface of the picture as vertices and normals. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "povray.h"

static bool no_memory(cli_error *error) { return cli_fail(error, CLI_FAILED, "memory ran out"); }

static povray_vertex corner_of(const picture *p, uint32_t number, uint32_t triangle, int corner) {
    const raster_surface *surface = &p->surfaces[number];
    const facing *normals = &p->normals[number];
    const double weight[3] = {corner == 0, corner == 1, corner == 2};
    vector n = normals->around ? normals_smooth(normals, surface, triangle, weight)
                               : normals_flat(normals, triangle);
    if (vector_length(n) == 0) n = (vector){0, 1, 0};
    povray_vertex v = {.normal = {(float)n.x, (float)n.y, (float)n.z}, .triangle = triangle};
    const uint32_t index = surface->indices[3 * (size_t)triangle + (size_t)corner];
    memcpy(v.position, surface->positions + 3 * (size_t)index, sizeof v.position);
    return v;
}

bool povray_surface_make(povray_surface *out, const picture *p, uint32_t number, cli_error *error) {
    const size_t triangles = p->surfaces[number].triangle_count, corners = 3 * triangles;
    *out = (povray_surface){
        .vertex_count = corners, .vertex_room = corners + 1, .triangle_count = triangles};
    if (corners >= UINT32_MAX)
        return cli_fail(error, CLI_FAILED, "a mesh of more than 2^32 corners is too large");
    out->vertices = malloc((corners + 1) * sizeof *out->vertices);
    out->corners = malloc((corners + 1) * sizeof *out->corners);
    if (!out->vertices || !out->corners) return povray_surface_free(out), no_memory(error);
    for (size_t i = 0; i < corners; i++) {
        out->corners[i] = (uint32_t)i;
        out->vertices[i] = corner_of(p, number, (uint32_t)(i / 3), (int)(i % 3));
    }
    return true;
}

void povray_surface_free(povray_surface *surface) {
    free(surface->vertices);
    free(surface->corners);
    free(surface->seen);
    *surface = (povray_surface){.vertex_count = 0};
}

static bool same(const povray_vertex *a, const povray_vertex *b) {
    return memcmp(a->position, b->position, sizeof a->position) == 0 &&
           memcmp(a->normal, b->normal, sizeof a->normal) == 0;
}

static size_t hash_of(const povray_vertex *v) {
    uint64_t hash = 0, words[3];
    memcpy(words, v->position, sizeof words);
    for (int i = 0; i < 3; i++) hash = (hash ^ words[i]) * 0x9e3779b97f4a7c15u;
    return (size_t)(hash >> 24);
}

bool povray_surface_weld(povray_surface *s, cli_error *error) {
    size_t room = 16, count = 0;
    while (room < 2 * s->vertex_count) room *= 2;
    uint32_t *places = malloc(room * sizeof *places);
    uint32_t *now = malloc((s->vertex_count + 1) * sizeof *now);
    s->seen = malloc(3 * s->triangle_count + 1);
    if (places && now && s->seen) {
        for (size_t i = 0; i < 3 * s->triangle_count; i++)
            s->seen[i] = (uint8_t)lrintf(255 * s->vertices[s->corners[i]].seen);
        memset(places, 0xff, room * sizeof *places);
        for (size_t i = 0; i < s->vertex_count; i++) {
            size_t at = hash_of(&s->vertices[i]) & (room - 1);
            while (places[at] != UINT32_MAX && !same(&s->vertices[places[at]], &s->vertices[i]))
                at = (at + 1) & (room - 1);
            if (places[at] == UINT32_MAX) {
                s->vertices[count] = s->vertices[i];
                places[at] = (uint32_t)count++;
            }
            now[i] = places[at];
        }
        for (size_t i = 0; i < 3 * s->triangle_count; i++) s->corners[i] = now[s->corners[i]];
        s->vertex_count = count;
    }
    const bool fine = places && now && s->seen;
    free(places);
    free(now);
    return fine || no_memory(error);
}
