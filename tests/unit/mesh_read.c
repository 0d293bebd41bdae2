/* Mesh files that are read right, and what the messages of the others say. */
#include "mesh_files.h"

#include <errno.h>
#include <locale.h>
#include <sys/stat.h>

/* ---- Small files and what becomes of them -----------------------------------------------------*/

typedef struct good {
    const char *name, *text;
    size_t vertices, triangles;
    const char *indices;
} good;

#define SQUARE "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
#define PLY_HEAD "ply\nformat ascii 1.0\n"
#define PLY_XYZ "property float x\nproperty float y\nproperty float z\n"
#define PLY_FACES "property list uchar int vertex_indices\nend_header\n"
#define PLY_POINTS "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"

static const good goods[] = {
    {"plain.obj", SQUARE "f 1 2 3\n", 4, 1, "0 1 2"},
    {"quad.obj", SQUARE "f 1 2 3 4", 4, 2, "0 1 2 0 2 3"},
    {"negative.obj", SQUARE "f -4 -3 -2\nv 0 0 1\nf -1 -2 1\n", 5, 2, "0 1 2 4 3 0"},
    {"forward.obj", "f 1 2 3\nf 2 3 4\n" SQUARE, 4, 2, "0 1 2 1 2 3"},
    {"forward_concave.obj", "f 1 2 3 4\nv 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\n", 4, 2, "0 1 2 0 2 3"},
    {"concave.obj", "v 1 1 0\nv 0 4 0\nv 0 0 0\nv 4 0 0\nf 2 3 4 1\n", 4, 2, "1 2 0 2 3 0"},
    {"forms.obj", SQUARE "vt 0 0\nvn nan 0 0\nf 1/1 2//1 3/1/1\nf 1/-1/-1 2/1 -1\n", 4, 2,
     "0 1 2 0 1 3"},
    {"weights.obj", "v 0 0 0 1\nv 1 0 0 .1 .2 .3\nv +1 1.e0 0 1 1 1 0.5\nf 1 2 3\n", 3, 1, "0 1 2"},
    {"continued.obj", "v 0 \\\n 0 0\nv 1 0 0\nv 0 1 0\nf 1\\\r\n 2\\\n\\\n3\n", 3, 1, "0 1 2"},
    {"crlf.obj", "# c\\\r\nv 0 0 0\r\nv 1 0 0\r\n\r\nv 0 1 0\r\n\tf\t1 2  3 # four\r\n", 3, 1,
     "0 1 2"},
    {"ignored.obj",
     "mtllib /etc/passwd\no x\n" SQUARE "g a b\\\n c\nusemtl \\n\ns off\nl 1 9\np 7\n"
     "f 1 2 3\n",
     4, 1, "0 1 2"},
    {"degenerate.obj", SQUARE "f 1 1 2\nf 1 2 1\nf 3 3 3\n", 4, 3, "0 0 1 0 1 0 2 2 2"},
    {"bom.obj", "\xef\xbb\xbf" SQUARE "f 1 2 3\n", 4, 1, "0 1 2"},
    {"CAPITALS.OBJ", SQUARE "f 1 2 3\n", 4, 1, "0 1 2"},
    {"plain.off", "OFF\n4 2 0\n" PLY_POINTS "3 0 1 2\n3 0 2 3\n", 4, 2, "0 1 2 0 2 3"},
    {"oneline.off", "# a\nOFF 4 1 0 # b\n\n0 0 0\n1 0 0 # c\n\n1 1 0\n0 1 0\n4 0 1 2 3 .1 .2 .3", 4,
     2, "0 1 2 0 2 3"},
    {"colours.off", "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 1 0 0\n0 1 0 7\n3 0 1 2 255 0 0\n", 3, 1,
     "0 1 2"},
    {"normals.off", "NOFF\n3 1\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n", 3, 1, "0 1 2"},
    {"all.off",
     "STCNOFF\n3 1 0\n0 0 0 0 0 1 1 1 1 .5 .25\n1 0 0 0 0 1 1 1 1 1 0 0\n"
     "0 1 0 0 0 1 9 1 1\n3 0 1 2\n",
     3, 1, "0 1 2"},
    {"noname", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", 3, 1, "0 1 2"},
    {"plain.stl",
     "solid a b\nfacet normal nan 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
     "vertex 0 1 0\nendloop\nendfacet\nendsolid a b\n",
     3, 1, "0 1 2"},
    {"two.stl",
     "\nSOLID\nFACET NORMAL 0 0 1 OUTER LOOP VERTEX 0 0 0 VERTEX 1 0 0 VERTEX 0 1 0 "
     "ENDLOOP ENDFACET\nendsolid\nsolid b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"
     "vertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid",
     6, 2, "0 1 2 3 4 5"},
    {"plain.ply",
     PLY_HEAD "element vertex 4\n" PLY_XYZ "element face 1\n" PLY_FACES PLY_POINTS "4 0 1 2 3\n", 4,
     2, "0 1 2 0 2 3"},
    {"crlf.ply",
     "ply\r\nformat ascii 1.0\r\ncomment a\r\nelement vertex 3\r\nproperty double x\r\n"
     "property double y\r\nproperty double z\r\nobj_info b\r\nelement face 1\r\n"
     "property list uint8 uint32 vertex_index\r\nend_header\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n"
     "3 0 1 2\r\n",
     3, 1, "0 1 2"},
    {"order.ply",
     PLY_HEAD "element extra 2\nproperty list uchar float q\nproperty int r\n"
              "element face 1\nproperty uchar red\nproperty list uchar int vertex_indices\n"
              "element vertex 4\nproperty float nx\n" PLY_XYZ "element edge 1\nproperty int a\n"
              "end_header\n0 5\n2 1 nan 6\n9 4 0 1 2 3\nnan 4 0 0\n0 1 1 0\n0 0 4 0\n0 0 0 0\n7\n",
     4, 2, "0 1 3 1 2 3"},
};

static void check_indices(const good *expected, const cli_mesh *mesh) {
    const char *at = expected->indices;
    for (size_t i = 0; i < 3 * mesh->triangle_count; i++) {
        char *end;
        unsigned long index = strtoul(at, &end, 10);
        if (end == at || mesh->indices[i] != index)
            fail_msg("%s: index %zu is %u, not %s", expected->name, i, mesh->indices[i],
                     expected->indices);
        at = end;
    }
}

static void reads_small_files(void **state) {
    (void) state;
    for (size_t i = 0; i < sizeof goods / sizeof *goods; i++) {
        cli_mesh mesh = mesh_read_good(mesh_write(goods[i].name, goods[i].text,
                                                  strlen(goods[i].text)));
        if (mesh.vertex_count != goods[i].vertices || mesh.triangle_count != goods[i].triangles)
            fail_msg("%s: %zu vertices, %zu triangles", goods[i].name, mesh.vertex_count,
                     mesh.triangle_count);
        check_indices(&goods[i], &mesh);
        assert_int_equal(mesh.unclean_faces, 0);
        cli_mesh_free(&mesh);
    }
}

/* ---- Small files and why they are refused -----------------------------------------------------*/

static const struct bad {
    const char *name, *text, *message;
} bads[] = {
    {"comma.obj", "v 0,5 0 0\n",
     ":1:3: '0,5' is not a number; x must be one, with a decimal point"},
    {"hex.obj", "v 0 0x10 0\n", ":1:5: '0x10' is not a number"},
    {"nan.obj", SQUARE "v 0 0 -NaN\n", ":5:7: '-NaN' is not finite"},
    {"inf.obj", "v 0 infinity 0\n", ":1:5: 'infinity' is not finite"},
    {"large.obj", "v 0 1e400 0\n", ":1:5: '1e400' is too large"},
    {"far.obj", "v 0 1.1e15 0\n", ":1:5: '1.1e15' is too large; y must be within +-1e15"},
    {"short.obj", "v 0 1\n", ":1:6: the line ends here; z must be a number"},
    {"five.obj", "v 0 1 2 3 4\n", ":1:12: the line ends here; v has 5 numbers"},
    {"eight.obj", "v 0 1 2 3 4 5 6 7\n", ":1:17: '7' is one too many"},
    {"joined.obj", "v 0 0 0v 1 0 0\n", ":1:7: '0v' is not a number"},
    {"zero.obj", SQUARE "f 0 1 2\n", ":5:3: '0' is no index of a vertex; from 1, or -4 to -1"},
    {"before.obj", SQUARE "f 1 2 -5\n", ":5:7: '-5' is no index"},
    {"least.obj", SQUARE "f 1 2 -9223372036854775808\n", ":5:7: '-9223372036854775808' is no"},
    {"range.obj", SQUARE "f 1 2 3\nf 1 2 5\nf 1 2 3\n",
     ":6:7: vertex 5 is named, but the file has 4"},
    {"range_vt.obj", SQUARE "f 1/1 2 3\n", ":5:5: texture coordinate 1 is named"},
    {"range_vn.obj", SQUARE "f 1//1 2 3\n", ":5:6: normal 1 is named"},
    {"two.obj", SQUARE "f 1 2\n", ":5:6: a face of 2 corners; 3 to 65536"},
    {"text.obj", SQUARE "f 1 2 x\n", ":5:7: 'x' is no index"},
    {"point.obj", SQUARE "f 1 2 3.5\n", ":5:7: '3.5' is no corner"},
    {"slash.obj", SQUARE "f 1/ 2/ 3/\n", ":5:5: the line ends here"},
    {"word.obj", SQUARE "quad 1 2 3 4\n", ":5:1: 'quad' is no keyword"},
    {"surface.obj", "surf 0 1 0 1 1 2 3\n", ":1:1: 'surf' is no keyword"},
    {"mac.obj", "v 0 0 0\rv 1 0 0\r", ":1:8: a carriage return alone"},
    {"escape.obj", "v \x1b[31m 0 0\n", ":1:3: '\\x1b[31m' is not a number"},
    {"points.obj", SQUARE, ": has no faces; a mesh has at least one triangle"},
    {"slashed.obj", SQUARE "f 1\\2 3\n", ":5:3: '1\\2' is no corner"},
    {"ply.obj", "ply\nformat ascii 1.0\n", "is named like OBJ but begins like PLY"},
    {"obj.ply", SQUARE "f 1 2 3\n", ":1:1: no PLY; such a file begins with ply"},
    {"off.stl", "OFF\n0 0 0\n", "is named like STL but begins like OFF"},
    {"foreign.txt", SQUARE "f 1 2 3\n", "neither its name nor its first line"},
    {"binary.off", "OFF BINARY\n", ":1:5: 'BINARY' OFF is not read"},
    {"four.off", "4OFF\n1 1 1\n", ":1:1: '4OFF' has vertices of another dimension"},
    {"counts.off", "OFF\n4000000000 4000000000 0\n0 0 0\n", ":2:1: 4000000000 vertices"},
    {"negative.off", "OFF\n-3 1 0\n", ":2:1: '-3' is no number of vertices"},
    {"corner.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", ":6:7: vertex 3 (counted from 0)"},
    {"two.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1     \n", ":6:1: a face of 2 corners"},
    {"more.off", "OFF\n3 1 0\n0 0 0 5\n1 0 0\n0 1 0\n3 0 1 2\n", ":3:7: '5' is one too many"},
    {"less.off", "NOFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", ":3:6: the line ends here"},
    {"after.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\nx\n", ":7:1: 'x' stands behind"},
    {"facet.stl",
     "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
     "vertex 1 1 1\n",
     ":7:1: 'vertex' stands where 'endloop' must"},
    {"empty.stl", "solid\nendsolid\n", "has no faces"},
    {"short.stl", "xsolid\n", ": byte 7: the file ends; a binary STL has at least 84 bytes"},
    {"type.ply", PLY_HEAD "element vertex 3\nproperty quad x\n", ":4:10: 'quad' is no type"},
    {"list.ply", PLY_HEAD "element face 1\nproperty list float int vertex_indices\n",
     ":4:15: 'float' is no type of a list's length"},
    {"twice.ply", PLY_HEAD "element vertex 3\nproperty int x\nproperty int x\n",
     ":5:14: 'x' is a property of this element twice"},
    {"again.ply", PLY_HEAD "element vertex 3\nelement vertex 3\n",
     ":4:9: 'vertex' is announced twice"},
    {"name.ply",
     PLY_HEAD "element fa\xff\x1a 99\nproperty int t\nelement vertex 4\n" PLY_XYZ
              "element face 1\n" PLY_FACES PLY_POINTS,
     ":3:9: 99 records fa?? are announced"},
    {"version.ply", "ply\nformat ascii 2.0\n", ":2:14: '2.0' is no version; 1.0 is"},
    {"late.ply", "ply\nelement vertex 3\n", ":2:1: 'element' stands where 'format' must"},
    {"nox.ply", PLY_HEAD "element vertex 1\nproperty float y\nelement face 1\n" PLY_FACES,
     ":3:9: element vertex must have properties x, y and z"},
    {"cloud.ply", PLY_HEAD "element vertex 4\n" PLY_XYZ "end_header\n" PLY_POINTS,
     ":1:1: no faces"},
    {"nothing.ply",
     PLY_HEAD "element vertex 0\n" PLY_XYZ "element void 9\nelement face 1\n" PLY_FACES,
     ":7:9: an element without properties"},
    {"negative.ply",
     PLY_HEAD "element vertex 4\n" PLY_XYZ "element face 1\n"
              "property list char int vertex_indices\nend_header\n" PLY_POINTS "-3 0 1 2\n",
     ":14:1: '-3' is no length of a list"},
    {"range.ply",
     PLY_HEAD "element vertex 4\n" PLY_XYZ "element face 1\n" PLY_FACES PLY_POINTS "300 0 1 2\n",
     ":14:1: '300' is no value of the integer type"},
    {"corner.ply",
     PLY_HEAD "element vertex 4\n" PLY_XYZ "element face 1\n" PLY_FACES PLY_POINTS "3 0 1 -1\n",
     ":14:7: vertex -1 (counted from 0) is named, but the file has 4"},
    {"two.ply",
     PLY_HEAD "element vertex 4\n" PLY_XYZ "element face 1\n" PLY_FACES PLY_POINTS "2 0 1    \n",
     ":14:1: a face of 2 corners"},
    {"missing.ply",
     PLY_HEAD "element vertex 4\n" PLY_XYZ "element face 1\n" PLY_FACES
              "0 0 0\n1 0\n1 1 0 0\n0 1 0\n3 0 1 2\n",
     ":11:4: the line ends here; z"},
    {"single.ply",
     PLY_HEAD "element vertex 4\n" PLY_XYZ "element face 1\n" PLY_FACES
              "0 0 1e39\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n",
     ":10:5: '1e39' is too large"},
    {"after.ply",
     PLY_HEAD "element vertex 4\n" PLY_XYZ "element face 1\n" PLY_FACES PLY_POINTS
              "3 0 1 2\n\n3 0 1 2\n",
     ":16:1: '3' stands behind the last record"},
};

static void refuses_in_one_line(void **state) {
    (void) state;
    for (size_t i = 0; i < sizeof bads / sizeof *bads; i++) {
        const char *path = mesh_write(bads[i].name, bads[i].text, strlen(bads[i].text));
        cli_mesh mesh;
        cli_error error;
        if (cli_mesh_read(path, &mesh, &error)) fail_msg("%s is read", bads[i].name);
        mesh_check_refusal(path, &mesh, &error);
        if (!strstr(error.text, bads[i].message))
            fail_msg("%s: \"%s\" is not in: %s", bads[i].name, bads[i].message, error.text);
    }
}

/* ---- Precision, both byte orders, every type --------------------------------------------------*/

enum { VERTICES = 200, FACES = 300 };

typedef struct sample {
    double position[VERTICES][3];
    uint32_t face[FACES][3];
} sample;

static void draw(sample *s, bool single, uint64_t seed) {
    for (int i = 0; i < VERTICES; i++)
        for (int k = 0; k < 3; k++) {
            double value = (mesh_uniform(&seed) - .5) * exp(40 * (mesh_uniform(&seed) - .5));
            s->position[i][k] = single ? (double) (float) value : value;
        }
    for (int i = 0; i < FACES; i++)
        for (int k = 0; k < 3; k++) s->face[i][k] = (uint32_t) (mesh_random(&seed) % VERTICES);
}

static void check_sample(const sample *s, const cli_mesh *mesh, uint32_t type) {
    assert_int_equal(mesh->position_type, type);
    assert_int_equal(mesh->triangle_count, FACES);
    for (int i = 0; i < FACES; i++)
        for (int k = 0; k < 3; k++) {
            uint32_t vertex = mesh->indices[3 * i + k];
            for (int c = 0; c < 3; c++)
                assert_true(mesh_coordinate(mesh, vertex, c) == s->position[s->face[i][k]][c]);
        }
}

static const char *const ply_formats[] = {"ascii", "binary_little_endian", "binary_big_endian"};

/* format 0 to 2; lists before, between and after what is wanted. */
static void write_ply(blob *to, const sample *s, int format, bool single) {
    const char *type = single ? "float" : "double";
    bool big = format == 2;
    to->size = 0;
    blob_text(to, "ply\nformat %s 1.0\ncomment x\nelement vertex %d\nproperty list ushort short l\n"
                  "property %s x\nproperty %s y\nproperty uchar c\nproperty %s z\n"
                  "element face %d\nproperty double q\nproperty list uint ushort vertex_index\n"
                  "property list uchar double r\nend_header\n",
              ply_formats[format], VERTICES, type, type, type, FACES);
    for (int i = 0; i < VERTICES; i++) {
        const double *p = s->position[i];
        if (format == 0) {
            blob_text(to, "%d%s %.17g %.17g 7 %.17g\n", i % 3,
                      i % 3 == 2 ? " -1 5"
                      : i % 3    ? " 8"
                                 : "",
                      p[0], p[1], p[2]);
            continue;
        }
        blob_bytes(to, (uint64_t) (i % 3), 2, big);
        for (int k = 0; k < i % 3; k++) blob_bytes(to, 0xfff0, 2, big);
        for (int k = 0; k < 3; k++) {
            if (k == 2) blob_bytes(to, 7, 1, big);
            single ? blob_float(to, (float) p[k], big) : blob_double(to, p[k], big);
        }
    }
    for (int i = 0; i < FACES; i++) {
        const uint32_t *f = s->face[i];
        if (format == 0) {
            blob_text(to, "nan 3 %u %u %u 1 0.5\n", f[0], f[1], f[2]);
            continue;
        }
        blob_double(to, NAN, big);
        blob_bytes(to, 3, 4, big);
        for (int k = 0; k < 3; k++) blob_bytes(to, f[k], 2, big);
        blob_bytes(to, 1, 1, big);
        blob_double(to, .5, big);
    }
}

static blob file, other;

static void ply_comes_back(void **state) {
    (void) state;
    static sample s;
    for (int format = 0; format < 3; format++)
        for (int single = 0; single < 2; single++) {
            draw(&s, single, 7);
            write_ply(&file, &s, format, single);
            cli_mesh mesh = mesh_read_good(mesh_write("sample.ply", file.bytes, file.size));
            assert_int_equal(mesh.vertex_count, VERTICES);
            check_sample(&s, &mesh, single ? SOFTSHADOW_F32 : SOFTSHADOW_F64);
            cli_mesh_free(&mesh);
        }
}

/* A coordinate of every integer type, with its extremes. */
static void ply_reads_integers(void **state) {
    (void) state;
    static const struct integer {
        const char *type;
        unsigned size;
        double low, high;
    } integers[] = {{"char", 1, -128, 127},        {"uint8", 1, 0, 255},
                    {"short", 2, -32768, 32767},   {"uint16", 2, 0, 65535},
                    {"int", 4, -0x1p31, 0x1p31 - 1}, {"uint32", 4, 0, 0x1p32 - 1}};
    for (size_t i = 0; i < 6; i++)
        for (int format = 0; format < 3; format++) {
            const struct integer *n = &integers[i];
            const double values[9] = {n->low, 0, 0, n->high, 0, 0, 0, 1, 0};
            file.size = 0;
            blob_text(&file,
                      "ply\nformat %s 1.0\nelement vertex 3\nproperty %s x\nproperty %s y\n"
                      "property %s z\nelement face 1\nproperty list int %s vertex_index\n"
                      "end_header\n",
                      ply_formats[format], n->type, n->type, n->type, n->type);
            for (int k = 0; k < 9; k++)
                if (format == 0)
                    blob_text(&file, "%.0f%c", values[k], k % 3 == 2 ? '\n' : ' ');
                else
                    blob_bytes(&file, (uint64_t) (int64_t) values[k], n->size, format == 2);
            if (format == 0) {
                blob_text(&file, "3 0 1 2\n");
            } else {
                blob_bytes(&file, 3, 4, format == 2);
                for (unsigned k = 0; k < 3; k++) blob_bytes(&file, k, n->size, format == 2);
            }
            cli_mesh mesh = mesh_read_good(mesh_write("integers.ply", file.bytes, file.size));
            for (int k = 0; k < 9; k++)
                assert_true(mesh_coordinate(&mesh, (size_t) k / 3, k % 3) == values[k]);
            cli_mesh_free(&mesh);
        }
}

static void write_stl(blob *to, const sample *s) {
    to->size = 0;
    blob_text(to, "solid that begins like an ascii one%45s", "");
    blob_bytes(to, FACES, 4, false);
    for (int i = 0; i < FACES; i++) {
        for (int k = 0; k < 3; k++) blob_float(to, NAN, false);
        for (int k = 0; k < 9; k++)
            blob_float(to, (float) s->position[s->face[i][k / 3]][k % 3], false);
        blob_bytes(to, 0xffff, 2, false);
    }
}

static void stl_comes_back(void **state) {
    (void) state;
    static sample s;
    draw(&s, true, 11);
    write_stl(&file, &s);
    assert_int_equal(file.size, 84 + 50 * FACES);
    cli_mesh mesh = mesh_read_good(mesh_write("sample.stl", file.bytes, file.size));
    check_sample(&s, &mesh, SOFTSHADOW_F32);
    assert_int_equal(mesh.vertex_count, 3 * FACES);
    cli_mesh_free(&mesh);
    /* Without an ending the size tells. */
    mesh = mesh_read_good(mesh_write("sample", file.bytes, file.size));
    check_sample(&s, &mesh, SOFTSHADOW_F32);
    cli_mesh_free(&mesh);
}

/* Text that declares no type keeps every bit of a double. */
static void text_keeps_doubles(void **state) {
    (void) state;
    static sample s;
    draw(&s, false, 13);
    file.size = other.size = 0;
    blob_text(&other, "OFF\n%d %d 0\n", VERTICES, FACES);
    for (int i = 0; i < VERTICES; i++) {
        const double *p = s.position[i];
        blob_text(&file, "v %.17g %.17g %.17g\n", p[0], p[1], p[2]);
        blob_text(&other, "%.17g %.17g %.17g\n", p[0], p[1], p[2]);
    }
    for (int i = 0; i < FACES; i++) {
        const uint32_t *f = s.face[i];
        blob_text(&file, "f %u %u %u\n", f[0] + 1, f[1] + 1, f[2] + 1);
        blob_text(&other, "3 %u %u %u\n", f[0], f[1], f[2]);
    }
    cli_mesh obj = mesh_read_good(mesh_write("sample.obj", file.bytes, file.size));
    check_sample(&s, &obj, SOFTSHADOW_F64);
    cli_mesh off = mesh_read_good(mesh_write("sample.off", other.bytes, other.size));
    assert_true(mesh_same(&obj, &off));
    cli_mesh_free(&obj);
    cli_mesh_free(&off);
}

/* A host may have called setlocale(); here a decimal point is one. */
static void locale_changes_nothing(void **state) {
    static const char *const commas[] = {"de_DE.UTF-8", "de_DE", "fr_FR.UTF-8", "nl_NL.UTF-8"};
    bool found = false;
    for (size_t i = 0; i < 4 && !found; i++) found = setlocale(LC_ALL, commas[i]) != NULL;
    if (!found) { /* few machines have one: make it, where the sources are there */
        char command[160];
        snprintf(command, sizeof command,
                 "localedef -i de_DE -f UTF-8 '%s/de_DE.UTF-8' >/dev/null 2>&1", mesh_folder);
        if (system(command) != 0 || setenv("LOCPATH", mesh_folder, 1)) skip();
        if (!setlocale(LC_ALL, "de_DE.UTF-8")) skip();
    }
    char text[32];
    snprintf(text, sizeof text, "%.1f", 1.5);
    assert_string_equal(text, "1,5");
    const char *obj = "v 0.5 0 0\nv 1.25 0 0\nv 0 1.5 0\nf 1 2 3\n";
    cli_mesh mesh = mesh_read_good(mesh_write("locale.obj", obj, strlen(obj)));
    assert_true(mesh_coordinate(&mesh, 0, 0) == .5 && mesh_coordinate(&mesh, 2, 1) == 1.5);
    cli_mesh_free(&mesh);
    refuses_in_one_line(state);
    setlocale(LC_ALL, "C");
}

/* ---- Texture coordinates ----------------------------------------------------------------------*/

static cli_mesh read_uvs(const char *name, const char *text) {
    cli_mesh mesh;
    cli_error error;
    if (!cli_mesh_read_uvs(mesh_write(name, text, strlen(text)), &mesh, &error))
        fail_msg("refused: %s", error.text);
    mesh_check(&mesh);
    return mesh;
}

static void obj_splits_vertices(void **state) {
    (void) state;
    /* A concave quad and a triangle; vertex 1 has two coordinates, vertex 3 the same twice. */
    cli_mesh mesh =
        read_uvs("uv.obj", "v 1 1 0\nv 0 4 0\nv 0 0 0\nv 4 0 0\nvt 0 .25\nvt .5\nvt 1 1 0\n"
                           "f 2/1 3/2 4/3 1/1\nf 1/3 3/2 4/3\n");
    static const double corners[9][4] = {{0, 4, 0, .25}, {0, 0, .5, 0}, {1, 1, 0, .25},
                                         {0, 0, .5, 0},  {4, 0, 1, 1},  {1, 1, 0, .25},
                                         {1, 1, 1, 1},   {0, 0, .5, 0}, {4, 0, 1, 1}};
    assert_int_equal(mesh.vertex_count, 5);
    assert_int_equal(mesh.triangle_count, 3);
    for (int i = 0; i < 9; i++) {
        uint32_t v = mesh.indices[i];
        assert_true(mesh_coordinate(&mesh, v, 0) == corners[i][0] &&
                    mesh_coordinate(&mesh, v, 1) == corners[i][1] &&
                    mesh.uvs[2 * v] == corners[i][2] && mesh.uvs[2 * v + 1] == corners[i][3]);
    }
    cli_mesh_free(&mesh);
    mesh = read_uvs("none.obj", SQUARE "vt 0 0\nf 1 2 3\n");
    assert_null(mesh.uvs);
    cli_mesh_free(&mesh);
}

static void obj_wants_all_uvs(void **state) {
    (void) state;
    static const char *const texts[] = {
        SQUARE "vt 0 0\nf 1/1 2/1 3\n", SQUARE "vt 0 0\nf 1 2 3/1\n",
        SQUARE "vt 0 0\nf 1/1 2/1 3/1\nf 1 2 3\n", SQUARE "vt nan 0\nf 1/1 2/1 3/1\n"};
    for (int i = 0; i < 4; i++) {
        const char *path = mesh_write("half.obj", texts[i], strlen(texts[i]));
        cli_mesh mesh;
        cli_error error;
        assert_false(cli_mesh_read_uvs(path, &mesh, &error));
        mesh_check_refusal(path, &mesh, &error);
        mesh = mesh_read_good(path); /* not asked for, they do not matter */
        cli_mesh_free(&mesh);
    }
}

static void vertices_have_uvs(void **state) {
    (void) state;
    cli_mesh mesh = read_uvs("uv.off", "STCOFF\n3 1 0\n0 0 0 7 .5 .25\n1 0 0 1 1 1 1 1 0\n"
                                       "0 1 0 1 1 1 0 1\n3 0 1 2\n");
    const float expected[6] = {.5f, .25f, 1, 0, 0, 1};
    assert_memory_equal(mesh.uvs, expected, sizeof expected);
    cli_mesh_free(&mesh);
    mesh = read_uvs("uv.ply", PLY_HEAD "element vertex 3\nproperty float t\n" PLY_XYZ
                              "property double s\nelement face 1\n" PLY_FACES
                              ".25 0 0 0 .5\n0 1 0 0 1\n1 0 1 0 0\n3 0 1 2\n");
    assert_memory_equal(mesh.uvs, expected, sizeof expected);
    cli_mesh_free(&mesh);
}

/* ---- Files that are none ----------------------------------------------------------------------*/

static void refuse(const char *path, const char *message) {
    cli_mesh mesh;
    cli_error error;
    assert_false(cli_mesh_read(path, &mesh, &error));
    mesh_check_refusal(path, &mesh, &error);
    if (!strstr(error.text, message)) fail_msg("\"%s\" is not in: %s", message, error.text);
}

static void refuses_what_is_no_file(void **state) {
    (void) state;
    refuse(mesh_path("absent.obj"), "cannot be opened: No such file");
    assert_int_equal(mkdir(mesh_path("folder.obj"), 0700), 0);
    refuse(mesh_path("folder.obj"), "is a directory");
    assert_int_equal(mkfifo(mesh_path("fifo.obj"), 0600), 0);
    refuse(mesh_path("fifo.obj"), "is no regular file");
    refuse("/dev/null", "is no regular file");
    refuse(mesh_write("empty.obj", "", 0), "is empty");
    refuse(mesh_write("nul.obj", "v 0 0 0\nv 1 \0 0\n", 16), ":2:5: a NUL byte");
    mesh_write("sparse.ply", "ply\n", 4);
    if (truncate(mesh_path("sparse.ply"), (off_t) 1 << 42) == 0)
        refuse(mesh_path("sparse.ply"), "at most half of this machine's memory");
    if (geteuid() != 0) {
        assert_int_equal(chmod(mesh_write("closed.obj", "v", 1), 0), 0);
        refuse(mesh_path("closed.obj"), "cannot be opened: Permission denied");
    }
}

static void shortens_what_it_quotes(void **state) {
    (void) state;
    cli_mesh mesh;
    cli_error error;
    memset(file.bytes, 'x', 60000);
    file.bytes[0] = 'v', file.bytes[1] = ' ';
    assert_false(cli_mesh_read(mesh_write("long.obj", file.bytes, 60000), &mesh, &error));
    assert_non_null(
        strstr(error.text, ":1:3: 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...' is not"));
    char name[240];
    memset(name, 'n', 230);
    strcpy(name + 225, "\n.obj");
    assert_false(cli_mesh_read(mesh_write(name, "v 1 x 0", 7), &mesh, &error));
    assert_memory_equal(error.text, "...nnnn", 7);
    assert_non_null(strstr(error.text, "?.obj:1:5: 'x' is not a number; y must be a finite"));
}

/* ---- The bunny --------------------------------------------------------------------------------*/

static void reads_the_bunny(void **state) {
    (void) state;
    const char *path = "/usr/share/glmark2/models/bunny.obj";
    if (access(path, R_OK)) skip();
    cli_mesh mesh = mesh_read_good(path);
    assert_int_equal(mesh.vertex_count, 34835);
    assert_int_equal(mesh.triangle_count, 69666);
    assert_int_equal(mesh.faces, 69666);
    assert_string_equal(mesh.format, "OBJ");
    cli_mesh_free(&mesh);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reads_small_files),      cmocka_unit_test(refuses_in_one_line),
        cmocka_unit_test(ply_comes_back),         cmocka_unit_test(ply_reads_integers),
        cmocka_unit_test(stl_comes_back),         cmocka_unit_test(text_keeps_doubles),
        cmocka_unit_test(locale_changes_nothing), cmocka_unit_test(obj_splits_vertices),
        cmocka_unit_test(obj_wants_all_uvs),      cmocka_unit_test(vertices_have_uvs),
        cmocka_unit_test(refuses_what_is_no_file), cmocka_unit_test(shortens_what_it_quotes),
        cmocka_unit_test(reads_the_bunny),
    };
    return cmocka_run_group_tests(tests, mesh_folder_make, mesh_folder_remove);
}
