/* Wavefront OBJ: vertices and polygonal faces.
 * based on: Wavefront, "Advanced Visualizer", appendix B1, object files.
 *
 * Positive indices may name what comes later in the file; negative ones count back from here.
 * Faces before vertices cost nothing, since ranges are checked at the end. Normals are counted, not
 * read: exporters write nan for those of degenerate faces, and nothing here needs them; so are
 * texture coordinates, unless asked for. Curves and surfaces are refused: passed over in silence
 * they would be missing from the shadow. */
#include "mesh/readers.h"

#include "number.h"
#include "softshadow.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

typedef struct obj {
    cli_builder *builder;
    cli_scan text;
    bool uvs;
    uint64_t vertices, coordinates, normals;         /* so far */
    cli_reference vertex, coordinate, normal;        /* the highest that faces named */
} obj;

static bool expect_line_over(obj *o, const char *allowed) {
    if (cli_scan_line_over(&o->text)) return true;
    return cli_scan_fail_word(&o->text, allowed);
}

static bool read_v(obj *o) {
    double position[3], other;
    static const char *const names[] = {"x", "y", "z"};
    for (int k = 0; k < 3; k++)
        if (!cli_scan_coordinate(&o->text, names[k], &position[k])) return false;
    int more = 0; /* w; or red green blue, and alpha */
    for (; more < 4 && !cli_scan_line_over(&o->text); more++)
        if (!cli_scan_double(&o->text, "a weight or colour", &other)) return false;
    if (more == 2)
        return cli_scan_fail_word(&o->text, "v has 5 numbers; x y z, x y z w, or x y z and a "
                                            "colour of 3 or 4 are allowed");
    o->vertices++;
    return expect_line_over(o, "is one too many; v has x y z and at most 4 more numbers") &&
           cli_builder_vertex(o->builder, position);
}

static bool read_vt(obj *o) {
    o->coordinates++;
    if (!o->uvs) return true;
    float uv[2] = {0, 0}, third;
    if (!cli_scan_float(&o->text, "u", &uv[0])) return false;
    if (!cli_scan_line_over(&o->text) && !cli_scan_float(&o->text, "v", &uv[1])) return false;
    if (!cli_scan_line_over(&o->text) && !cli_scan_float(&o->text, "w", &third)) return false;
    return expect_line_over(o, "is one too many; vt has u and at most 2 more numbers") &&
           cli_builder_uv(o->builder, uv);
}

static bool read_vn(obj *o) {
    o->normals++;
    return true;
}

/* One number of a corner: 1, 2 ... from the file's beginning, -1, -2 ... from here backwards. */
static bool read_index(obj *o, const char **at, const char *of, uint64_t so_far,
                       cli_reference *reference, uint64_t *number) {
    const char *begin = *at, *end = o->text.source->data + o->text.source->size;
    int64_t parsed;
    cli_number result = cli_number_int(at, end, &parsed);
    if (result == CLI_NUMBER_OK && parsed > 0) {
        *number = (uint64_t) parsed;
    } else if (result == CLI_NUMBER_OK && parsed < 0 && (uint64_t) -(parsed + 1) < so_far) {
        *number = so_far - (uint64_t) -(parsed + 1);
    } else {
        char problem[120];
        snprintf(problem, sizeof problem, "is no index of a %s; from 1, or -%" PRIu64 " to -1 here",
                 of, so_far);
        o->text.at = begin;
        return cli_scan_fail_word(&o->text, problem);
    }
    if (*number > so_far) cli_reference_note(reference, *number, begin);
    return true;
}

/* v, v/vt, v//vn or v/vt/vn; *uv is 0 where there is none. */
static bool read_corner(obj *o, uint64_t *vertex, uint64_t *uv) {
    const char *at = o->text.at;
    uint64_t normal;
    *uv = 0;
    if (!read_index(o, &at, "vertex", o->vertices, &o->vertex, vertex)) return false;
    if (*at == '/') {
        at++;
        if (*at != '/' &&
            !read_index(o, &at, "texture coordinate", o->coordinates, &o->coordinate, uv))
            return false;
        if (*at == '/') {
            at++;
            if (!read_index(o, &at, "normal", o->normals, &o->normal, &normal)) return false;
        }
    }
    if (cli_is_blank(*at) || cli_is_line_end(*at) || cli_continuation(at)) {
        o->text.at = at;
        return true;
    }
    return cli_scan_fail_word(&o->text, "is no corner; v, v/vt, v//vn or v/vt/vn is allowed");
}

/* Opacity needs a place in the texture at every corner, or nowhere: half of it would be a guess. */
static bool note_uv(obj *o, uint64_t uv, const char *at) {
    cli_builder *builder = o->builder;
    if ((uv != 0) == builder->split) return true;
    return cli_source_fail(o->text.source, at, o->text.error,
                           "a corner %s a texture coordinate, others %s; all or none may have one",
                           uv ? "with" : "without", uv ? "have none" : "have one");
}

static bool read_f(obj *o) {
    cli_builder *builder = o->builder;
    const char *face = o->text.at;
    uint32_t corners = 0;
    for (; !cli_scan_line_over(&o->text); corners++) {
        uint64_t vertex, uv;
        const char *at = o->text.at;
        if (corners == CLI_POLYGON_CORNERS)
            return cli_scan_fail_word(&o->text, "is a corner too many; 3 to 65536 are allowed");
        if (corners >= builder->face_room && !cli_builder_face_room(builder, corners + 1))
            return false;
        if (!read_corner(o, &vertex, &uv)) return false;
        if (o->uvs && builder->mesh.faces == 0 && corners == 0) builder->split = uv != 0;
        if (o->uvs && !note_uv(o, uv, at)) return false;
        builder->face[corners] = (uint32_t) (vertex - 1);
        builder->face_uvs[corners] = (uint32_t) (uv - 1);
    }
    if (corners < 3)
        return cli_source_fail(o->text.source, o->text.at, o->text.error,
                               "a face of %" PRIu32 " corners; 3 to 65536 are allowed", corners);
    return cli_builder_face(builder, corners, face);
}

/* ---- Lines ------------------------------------------------------------------------------------*/

static bool pass_over(obj *o) {
    (void) o;
    return true;
}

static const struct keyword {
    const char *word;
    bool (*read)(obj *o);
} keywords[] = {
    {"v", read_v},          {"f", read_f},           {"vt", read_vt},       {"vn", read_vn},
    {"g", pass_over},       {"o", pass_over},        {"s", pass_over},      {"usemtl", pass_over},
    {"mtllib", pass_over},  {"l", pass_over},        {"p", pass_over},      {"fo", read_f},
    {"vp", pass_over},      {"usemap", pass_over},   {"maplib", pass_over}, {"mg", pass_over},
    {"lod", pass_over},     {"bevel", pass_over},    {"c_interp", pass_over},
    {"d_interp", pass_over}, {"shadow_obj", pass_over}, {"trace_obj", pass_over},
};

static bool read_line(obj *o) {
    const char *end = cli_scan_word_end(&o->text);
    size_t length = (size_t) (end - o->text.at);
    for (size_t i = 0; i < sizeof keywords / sizeof *keywords; i++) {
        const char *word = keywords[i].word;
        if (strncmp(o->text.at, word, length) || word[length]) continue;
        o->text.at = end;
        return keywords[i].read(o);
    }
    return cli_scan_fail_word(&o->text, "is no keyword that can be read; polygons (v vt vn f) are, "
                                        "with g o s l p usemtl mtllib passed over");
}

static bool check_range(const obj *o, const cli_reference *reference, uint64_t count,
                        const char *of) {
    if (reference->highest <= count) return true;
    return cli_source_fail(o->text.source, reference->at, o->text.error,
                           "%s %" PRIu64 " is named, but the file has %" PRIu64, of,
                           reference->highest, count);
}

bool cli_read_obj(cli_builder *builder, bool uvs) {
    obj o = {.builder = builder, .uvs = uvs};
    o.text = (cli_scan){builder->source, builder->error, builder->source->data, true};
    builder->corner_uvs = uvs;
    builder->mesh.format = "OBJ";
    if (!cli_source_text(builder->source, 0, "f", builder->error) ||
        !cli_builder_begin(builder, SOFTSHADOW_F64, 0, 0))
        return false;
    if (strncmp(o.text.at, "\xef\xbb\xbf", 3) == 0) o.text.at += 3; /* a byte order mark */
    while (cli_scan_next_record(&o.text)) {
        if (!read_line(&o)) return false;
        cli_scan_next_line(&o.text);
    }
    return check_range(&o, &o.vertex, o.vertices, "vertex") &&
           check_range(&o, &o.coordinate, o.coordinates, "texture coordinate") &&
           check_range(&o, &o.normal, o.normals, "normal");
}
