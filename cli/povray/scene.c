/* scene.c - the whole picture as a scene of POV-Ray 3.7. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "povray.h"

typedef struct writer {
    const povray_job *job;
    const picture *picture;
    cli_output *output;
    cli_error *error;
    bool failed;
} writer;

static void put(writer *w, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void put(writer *w, const char *format, ...) {
    char text[2048];
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (w->failed) return;
    if (length < 0 || length >= (int)sizeof text)
        w->failed = !cli_fail(w->error, CLI_FAILED, "%s: its path is too long",
                              w->output->name);
    else
        w->failed = !cli_output_write(w->output, text, (size_t)length, w->error);
}

static void put_vector(writer *w, const char *before, vector v, const char *after) {
    put(w, "%s<%.10g, %.10g, %.10g>%s", before, v.x, v.y, v.z, after);
}

/* ---- What comes first -----------------------------------------------------------------------*/

static void put_box(writer *w) {
    const picture *p = w->picture;
    vector low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t s = 0; s < p->surface_count; s++)
        for (size_t i = 0; i < p->surfaces[s].vertex_count; i++) {
            const vector v = vector_of(p->surfaces[s].positions + 3 * i);
            low = (vector){fmin(low.x, v.x), fmin(low.y, v.y), fmin(low.z, v.z)};
            high = (vector){fmax(high.x, v.x), fmax(high.y, v.y), fmax(high.z, v.z)};
        }
    /* Beyond what is in it: a position at its very edge would be black, which means nothing. */
    const double margin = p->radius / 64;
    const vector around = {margin, margin, margin};
    low = vector_sub(low, around), high = vector_add(high, around);
    put_vector(w, "#declare Box_Low = ", low, ";\n");
    put_vector(w, "#declare Box_High = ", high, ";\n");
    put(w,
        "// softshadow povray --positions HIGH.png,LOW.png --normals N.png -o P.exr \\\n"
        "//     --box %.10g,%.10g,%.10g,%.10g,%.10g,%.10g\n\n",
        low.x, low.y, low.z, high.x, high.y, high.z);
}

static void put_head(writer *w, const char *include) {
    const picture *p = w->picture;
    put(w,
        "// A scene of softshadow %s for POV-Ray 3.7:\n"
        "//     povray +I%s +W%u +H%u +A0.1 %s\n"
        "// Light: 0 all lights, n only the n-th, -1 none. Pass: 0 the picture; for position and "
        "normal\n"
        "// images -A +FN16 File_Gamma=1.0 and Pass=1 (coarse), 2 (fine), 3 (normals).\n"
        "#version 3.7;\n"
        "#ifndef (Light) #declare Light = %d; #end\n"
        "#ifndef (Ambient) #declare Ambient = %.10g; #end\n"
        "#ifndef (Pass) #declare Pass = 0; #end\n"
        "global_settings { assumed_gamma 1.0 }\n%s",
        softshadow_version_string(), w->output->name, p->width, p->height,
        "+L" SOFTSHADOW_POVRAY_DIR,
        w->job->shadows == POVRAY_PROJECTED && p->build->light_count > 1, p->ambient, include);
    put_box(w);
}

static void put_camera(writer *w) {
    const viewpoint *c = &w->picture->camera;
    put_vector(w, "#declare Eye = ", c->eye, ";\n");
    put_vector(w, "#declare Forward = ", c->forward, ";\n");
    put_vector(w, "#declare Right = ", vector_scale(c->right, 2 * c->tan_x), ";\n");
    put_vector(w, "#declare Up = ", vector_scale(c->up, 2 * c->tan_y), ";\n");
    put(w, "camera { perspective location Eye direction Forward right Right up Up }\n\n");
}

/* ---- Lights ---------------------------------------------------------------------------------*/

/* Two perpendicular vectors across a direction. */
static void across(vector direction, double length, vector *u, vector *v) {
    const vector n = vector_unit(direction);
    const vector other = fabs(n.x) < 0.6 ? (vector){1, 0, 0} : (vector){0, 1, 0};
    *u = vector_scale(vector_unit(vector_cross(n, other)), length);
    *v = vector_scale(vector_cross(n, vector_unit(*u)), length);
}

static void put_area(writer *w, vector u, vector v, const char *more) {
    const uint32_t n = w->job->area;
    put_vector(w, "  area_light ", u, ", ");
    put_vector(w, "", v, "");
    put(w, ", %u, %u %s\n", n, n, more);
}

/* area_light takes whole axes where ours are half. */
static void put_light(writer *w, uint32_t number) {
    const softshadow_light *light = &w->picture->build->lights[number];
    const double whole = 1.0 / w->picture->build->light_count;
    vector at = vector_of(light->position), u, v;
    double radius = light->radius;
    if (light->type == SOFTSHADOW_SUN) {
        const double far = 1000 * w->picture->radius;
        at = vector_sub(w->picture->centre,
                        vector_scale(vector_unit(vector_of(light->direction)), far));
        radius = far * tan(light->radius);
    }
    put(w, "#if (Light = 0 | Light = %u)\nlight_source {\n", number + 1);
    put_vector(w, "  ", at, "");
    put(w, ", rgb %.10g\n", whole);
    if (light->type == SOFTSHADOW_SUN) {
        put(w, "  parallel ");
        put_vector(w, "point_at ", w->picture->centre, "\n");
    }
    if (w->job->shadows != POVRAY_AREA) {
        put(w, "  shadowless\n");
    } else if (light->type == SOFTSHADOW_RECT) {
        put_area(w, vector_scale(vector_of(light->u), 2), vector_scale(vector_of(light->v), 2), "");
    } else if (radius > 0) {
        const bool sphere = light->type == SOFTSHADOW_SPHERE;
        across(sphere ? (vector){0, 1, 0} : vector_of(light->direction), 2 * radius, &u, &v);
        put_area(w, u, v, sphere ? "circular orient" : "circular");
    }
    put(w, "}\n#end\n");
}

/* ---- Projected visibility -------------------------------------------------------------------*/

/* "a/b.pov" and 1: "a/b.visibility.2.exr". */
static void name_image(const char *output, uint32_t light, char path[4096]) {
    const char *dot = strrchr(output, '.');
    const int stem = dot ? (int)(dot - output) : (int)strlen(output);
    if (light)
        snprintf(path, 4096, "%.*s.visibility.%u.exr", stem, output, light + 1);
    else
        snprintf(path, 4096, "%.*s.visibility.exr", stem, output);
}

/* The picture's own visibility, one ray a pixel of it: POV-Ray reads red, green and blue. */
static bool write_images(povray_job *job, cli_scene *scene, cli_error *error) {
    static const char *const names[] = {"R", "G", "B"};
    picture *p = &job->request.picture;
    const uint32_t lights = job->request.build.light_count;
    char path[4096];
    if (!picture_begin(p, error) || !picture_rows(p, scene, 0, p->height, error)) return false;
    planes *list = calloc(1, sizeof *list);
    if (!list) return cli_fail(error, CLI_FAILED, "memory ran out");
    bool fine = true;
    for (uint32_t l = 0; fine && l < lights; l++) {
        list->count = 0;
        for (int c = 0; c < 3; c++) planes_add(list, p->visibility + l, lights, 1, names + c);
        name_image(job->output, l, path);
        fine = povray_write_exr(path, list, p->width, p->height, error);
    }
    free(list);
    return fine;
}

static void put_visibility(writer *w) {
    char path[4096];
    put(w, "Softshadow_Camera(Eye, Forward, Right, Up)\n");
    for (uint32_t l = 0; l < w->picture->build->light_count; l++) {
        name_image(w->job->output, l, path);
        const char *slash = strrchr(path, '/');
        put(w, "#if (%s = %u) Softshadow_Visibility(\"%s\") #end\n", l ? "Light" : "max(Light, 1)",
            l + 1, slash ? slash + 1 : path);
    }
    put(w, "#if (Light < 0) #declare Softshadow_Seen = function(x, y, z) { 1 } #end\n");
}

/* ---- Surfaces -------------------------------------------------------------------------------*/

/* Diffuse is what of the light's part is seen; ambient light is always. */
static void put_look(writer *w, const char *name, const double albedo[3]) {
    put(w,
        "#macro %s(Seen)\n  texture {\n    pigment { rgb <%.10g, %.10g, %.10g> }\n"
        "    finish { ambient Ambient diffuse Seen }\n  }\n#end\n",
        name, albedo[0], albedo[1], albedo[2]);
}

static void put_vertices(writer *w, const povray_surface *s) {
    put(w, "mesh2 {\n  vertex_vectors {\n    %zu", s->vertex_count);
    for (size_t i = 0; i < s->vertex_count; i++) {
        const double *p = s->vertices[i].position;
        put(w, ",\n    <%.10g,%.10g,%.10g>", p[0], p[1], p[2]);
    }
    put(w, "\n  }\n  normal_vectors {\n    %zu", s->vertex_count);
    for (size_t i = 0; i < s->vertex_count; i++) {
        const float *n = s->vertices[i].normal;
        put(w, ",\n    <%.5g,%.5g,%.5g>", (double)n[0], (double)n[1], (double)n[2]);
    }
    put(w, "\n  }\n");
}

static bool has_area(const povray_surface *s, size_t t) {
    vector v[3];
    for (size_t c = 0; c < 3; c++) v[c] = vector_of(s->vertices[s->corners[3 * t + c]].position);
    return vector_length(vector_cross(vector_sub(v[1], v[0]), vector_sub(v[2], v[0]))) > 0;
}

/* A face of a baked surface names a texture for each corner, by what is seen there. */
static void put_faces(writer *w, const povray_surface *s, bool baked) {
    size_t count = 0;
    for (size_t t = 0; t < s->triangle_count; t++) count += has_area(s, t);
    put(w, "  face_indices {\n    %zu", count);
    for (size_t t = 0; t < s->triangle_count; t++) {
        const uint32_t *c = s->corners + 3 * t;
        if (!has_area(s, t)) continue;
        put(w, ",\n    <%u,%u,%u>", c[0], c[1], c[2]);
        if (baked)
            put(w, ",%u,%u,%u", s->seen[3 * t], s->seen[3 * t + 1], s->seen[3 * t + 2]);
    }
    put(w, "\n  }\n");
}

static void put_textures(writer *w, const char *look) {
    put(w,
        "  texture_list {\n    256\n"
        "    #local K = 0;\n"
        "    #while (K < 256)\n"
        "      , #if (Pass) texture { Shown } #else %s(K / 255) #end\n"
        "      #local K = K + 1;\n"
        "    #end\n  }\n",
        look);
}

/* Between the many small triangles of a baked ground rays slip through now and then: behind them
 * the ground once more. */
static void put_backing(writer *w) {
    const picture *p = w->picture;
    const raster_surface *ground = &p->surfaces[p->ground];
    const vector up = p->up == 'z' ? (vector){0, 0, 1} : (vector){0, 1, 0};
    put(w, "mesh {\n");
    for (size_t t = 0; t < ground->triangle_count; t++) {
        put(w, "  triangle {");
        for (size_t c = 0; c < 3; c++)
            put_vector(w, c ? ", " : " ",
                       vector_of(ground->positions + 3 * (size_t)ground->indices[3 * t + c]), "");
        put(w, " }\n");
    }
    put(w, "  #if (Pass) texture { Shown } #else Look_Of_Ground(1) #end\n  no_shadow\n");
    put_vector(w, "  translate ", vector_scale(up, -p->radius / 8192), "\n}\n\n");
}

static bool put_surface(writer *w, cli_scene *scene, uint32_t number, size_t *room) {
    const bool ground = number == w->picture->ground, baked = w->job->shadows == POVRAY_BAKED;
    const char *look = ground ? "Look_Of_Ground" : "Look_Of_Meshes";
    povray_surface s;
    if (!povray_surface_make(&s, w->picture, number, w->error)) return false;
    for (size_t i = 0; i < s.vertex_count; i++) s.vertices[i].seen = 1;
    bool fine = !baked || povray_bake(&s, w->picture, number, scene, room, w->error);
    fine = fine && povray_surface_weld(&s, w->error);
    if (fine) {
        put(w, "// %s, %zu triangles\n", ground ? "the ground" : "a mesh", s.triangle_count);
        put_vertices(w, &s);
        if (baked) put_textures(w, look);
        put_faces(w, &s, baked);
        if (!baked && w->job->shadows == POVRAY_PROJECTED)
            put(w, "  #if (Pass) texture { Shown } #else Softshadow_Texture(%s(0), %s(1)) #end\n",
                look, look);
        else if (!baked)
            put(w, "  #if (Pass) texture { Shown } #else %s(1) #end\n", look);
        put(w, "%s}\n\n", ground ? "  no_shadow\n" : "");
        fine = !w->failed;
    }
    povray_surface_free(&s);
    return fine;
}

static bool write_scene(writer *w, cli_scene *scene) {
    const picture *p = w->picture;
    const bool projected = w->job->shadows == POVRAY_PROJECTED;
    put_head(w, projected ? "#include \"softshadow.inc\"\n\n"
                          : "#if (Pass)\n#include \"softshadow.inc\"\n#end\n\n");
    put_camera(w);
    for (uint32_t l = 0; l < p->build->light_count; l++) put_light(w, l);
    put(w, "\n#if (Pass = 1 | Pass = 2)\n#declare Shown = Softshadow_Positions(Box_Low, Box_High, "
           "Pass)\n#end\n#if (Pass = 3)\n#declare Shown = Softshadow_Normals()\n#end\n");
    if (projected) put_visibility(w);
    put_look(w, "Look_Of_Meshes", p->albedo);
    put_look(w, "Look_Of_Ground", p->ground_albedo);
    put(w, "\n");
    size_t room = w->job->most;
    if (w->job->shadows == POVRAY_BAKED && p->ground != RASTER_NONE) put_backing(w);
    for (uint32_t s = 0; s < p->surface_count && !w->failed; s++)
        if (!put_surface(w, scene, s, &room)) return false;
    if (!room && !p->build->quiet)
        fprintf(stderr, "softshadow povray: warning: --most %u triangles are used up, shadows are "
                        "coarser than they could be\n", w->job->most);
    return !w->failed;
}

bool povray_write_scene(povray_job *job, cli_scene *scene, cli_error *error) {
    picture *p = &job->request.picture;
    cli_output output = {.fd = -1};
    const uint32_t aa = p->aa, width = p->width, height = p->height;
    if (!picture_prepare(p, scene, job->request.ground, error)) return false;
    if (job->shadows == POVRAY_PROJECTED) {
        p->width *= aa, p->height *= aa, p->aa = 1;
        if (!write_images(job, scene, error)) return false;
        p->width = width, p->height = height;
    }
    if (!cli_output_open(&output, job->output, error)) return false;
    writer w = {job, p, &output, error, false};
    const bool fine = write_scene(&w, scene) && cli_output_commit(&output, error);
    cli_output_abandon(&output);
    return fine;
}
