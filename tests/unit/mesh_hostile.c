/* Mesh files that mean harm, or were cut short, or were damaged: read right or refused in one line,
 * in 5 seconds and 256 MB, and never a mesh that is not in the file. */
#include "mesh_files.h"

#include <dirent.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>

enum { READ = 10, REFUSED = 11, WRONG = 12 };

/* Sanitizers reserve terabytes of addresses; there only the time is limited. */
static bool is_sanitized(void) {
    const char *sanitizers = getenv("SANITIZERS");
    return sanitizers && *sanitizers;
}

static int in_child(const char *path, bool shown) {
    struct rlimit time = {5, 5}, memory = {256 << 20, 256 << 20};
    cli_mesh mesh;
    cli_error error;
    if (setrlimit(RLIMIT_CPU, &time)) return WRONG;
    if (!is_sanitized() && setrlimit(RLIMIT_AS, &memory)) return WRONG;
    alarm(30); /* a reader that waits uses no time of the CPU's; on a busy machine 5 s are few */
    if (cli_mesh_read(path, &mesh, &error)) {
        for (size_t i = 0; i < 3 * mesh.triangle_count; i++)
            if (mesh.indices[i] >= mesh.vertex_count) return WRONG;
        return READ;
    }
    if (shown) print_message("%s\n", error.text);
    bool fine = strncmp(error.text, path, strlen(path)) == 0 && error.status == 1;
    for (const char *c = error.text; *c; c++) fine = fine && *c >= 0x20;
    return fine && !mesh.positions && !mesh.indices ? REFUSED : WRONG;
}

static int outcome(const char *path, bool shown) {
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) _exit(in_child(path, shown));
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    if (WIFSIGNALED(status)) fail_msg("%s: killed by signal %d", path, WTERMSIG(status));
    return WEXITSTATUS(status);
}

static void expect(const char *path, int expected) {
    int came = outcome(path, false);
    if (came != expected)
        fail_msg("%s: %s", path, came == READ ? "was read" : came == REFUSED ? "was refused"
                                                                             : "a bad answer");
}

/* ---- The files that broke other readers -------------------------------------------------------*/

static void outlives_shared_files(void **state) {
    (void) state;
    static const char *const rights[] = {"edge3.obj", "cont.obj", "bowtie.obj"};
    char folder[400], path[700];
    const char *top = getenv("top_srcdir");
    snprintf(folder, sizeof folder, "%s/../shared/hostile", top ? top : ".");
    DIR *files = opendir(folder);
    if (!files) skip();
    int seen = 0, right = 0;
    for (struct dirent *entry; (entry = readdir(files));) {
        const char *dot = strrchr(entry->d_name, '.');
        if (entry->d_name[0] == '.' || !dot || strcmp(dot, ".md") == 0) continue;
        bool is_right = false;
        for (int i = 0; i < 3; i++) is_right = is_right || strcmp(entry->d_name, rights[i]) == 0;
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        int came = outcome(path, true);
        /* A mutant may have stayed a PLY; everything else is one or the other. */
        bool mutant = strncmp(entry->d_name, "crash_", 6) == 0;
        if (came != (is_right ? READ : REFUSED) && !(mutant && came == READ))
            fail_msg("%s: answer %d", path, came);
        seen++;
        right += is_right;
    }
    closedir(files);
    assert_int_equal(right, 3);
    assert_true(seen >= 30);
    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, rights[i]);
        cli_mesh mesh = mesh_read_good(path);
        static const size_t vertices[] = {5, 3, 5}, triangles[] = {3, 1, 2};
        assert_int_equal(mesh.vertex_count, vertices[i]);
        assert_int_equal(mesh.triangle_count, triangles[i]);
        cli_mesh_free(&mesh);
    }
}

/* ---- Files of our own -------------------------------------------------------------------------*/

static blob file, mutant;

#define BINARY_XYZ "property float x\nproperty float y\nproperty float z\n"
#define BINARY_FACES "property list uint int vertex_indices\nend_header\n"

static void is_not_impressed_by_counts(void **state) {
    (void) state;
    static const char *const counts[] = {
        "4294967295", "9223372036854775807", "18446744073709551616", "-1", "1e3", "1000000000000"};
    for (int i = 0; i < 6; i++)
        for (int which = 0; which < 3; which++) {
            file.size = 0;
            blob_text(&file, "ply\nformat binary_little_endian 1.0\nelement vertex %s\n" BINARY_XYZ
                             "element other %s\nproperty list uint double l\nelement face %s\n"
                             BINARY_FACES "%40s", which == 0 ? counts[i] : "1",
                      which == 1 ? counts[i] : "0", which == 2 ? counts[i] : "1", "");
            expect(mesh_write("count.ply", file.bytes, file.size), REFUSED);
            file.size = 0;
            blob_text(&file, "OFF\n%s %s 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
                      which == 0 ? counts[i] : "3", which == 1 ? counts[i] : "1");
            if (which < 2) expect(mesh_write("count.off", file.bytes, file.size), REFUSED);
        }
    static const uint32_t lengths[] = {0xffffffff, 0x40000000, 0x80000000, 65537, 4, 2, 0};
    for (int i = 0; i < 7; i++) { /* of a face's list, and one that is passed over */
        for (int which = 0; which < 2; which++) {
            file.size = 0;
            blob_text(&file, "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" BINARY_XYZ
                             "element face 1\n%s" BINARY_FACES,
                      which ? "property list uint double skipped\n" : "");
            for (int k = 0; k < 3; k++) blob_float(&file, 1, false);
            blob_bytes(&file, lengths[i], 4, false);
            for (int k = 0; k < 3; k++) blob_bytes(&file, 0, 4, false);
            expect(mesh_write("length.ply", file.bytes, file.size), REFUSED);
        }
    }
    file.size = 0;
    blob_text(&file, "%80s", "");
    blob_bytes(&file, 0x7fffffff, 4, false);
    blob_text(&file, "%50s", "");
    expect(mesh_write("count.stl", file.bytes, file.size), REFUSED);
}

/* A convex face on a parabola. */
static const char *write_face(uint32_t corners, const char *between) {
    file.size = 0;
    for (uint32_t i = 0; i < corners; i++)
        blob_text(&file, "v %u %.0f 0\n", i, (double) i * i);
    blob_text(&file, "f");
    for (uint32_t i = 0; i < corners; i++) blob_text(&file, "%s%u", between, i + 1);
    blob_text(&file, "\n");
    return mesh_write("face.obj", file.bytes, file.size);
}

static void keeps_lines_and_faces_in_bounds(void **state) {
    (void) state;
    expect(write_face(65536, " "), READ);          /* one line of 380 KB */
    expect(write_face(65536, " \\\n  "), READ);    /* a line for each corner */
    expect(write_face(65537, " "), REFUSED);
    expect(write_face(65536, "            "), REFUSED); /* one line of 1.1 MB */
    cli_mesh mesh = mesh_read_good(write_face(60000, " "));
    assert_int_equal(mesh.triangle_count, 59998);
    assert_int_equal(mesh.unclean_faces, 0);
    cli_mesh_free(&mesh);
    static const struct filler {
        const char *name, *begin, *end;
        size_t size;
        int expected;
    } fillers[] = {
        {"v.obj", "v 1 2 ", "\nf 1 1 1\n", 70000, REFUSED},
        {"comment.obj", "v 0 0 0\nf 1 1 1\n#", "\n", 70000, REFUSED},
        {"comment.obj", "v 0 0 0\nf 1 1 1\n#", "\n", 60000, READ},
        {"header.ply", "ply\nformat ascii 1.0\ncomment ", "\nelement vertex 1\n" BINARY_XYZ
         "element face 1\n" BINARY_FACES "0 0 0\n3 0 0 0\n", 70000, REFUSED},
        {"header.ply", "ply\nformat ascii 1.0\ncomment ", "\nelement vertex 1\n" BINARY_XYZ
         "element face 1\n" BINARY_FACES "0 0 0\n3 0 0 0\n", 60000, READ},
        {"header.ply", "ply\nformat ascii 1.0\ncomment ", "", 900000, REFUSED},
        {"name.stl", "solid ", "\nendsolid\n", 70000, REFUSED},
        {"off.off", "OFF\n1 1 0\n#", "\n0 0 0\n3 0 0 0\n", 70000, REFUSED},
    };
    for (size_t i = 0; i < sizeof fillers / sizeof *fillers; i++) {
        file.size = 0;
        blob_text(&file, "%s", fillers[i].begin);
        memset(file.bytes + file.size, '1', fillers[i].size);
        file.size += fillers[i].size;
        blob_text(&file, "%s", fillers[i].end);
        expect(mesh_write(fillers[i].name, file.bytes, file.size), fillers[i].expected);
    }
}

/* Faces that cross themselves everywhere, as many as a megabyte holds. */
static void keeps_tiling_in_bounds(void **state) {
    (void) state;
    uint64_t seed = 3;
    for (int corners = 100; corners <= 8000; corners *= 3) {
        file.size = 0;
        for (int i = 0; i < 900; i++)
            blob_text(&file, "v %.3f %.3f 0\n", mesh_uniform(&seed), mesh_uniform(&seed));
        while (file.size < 900000) {
            blob_text(&file, "f");
            for (int i = 0; i < corners; i++)
                blob_text(&file, " %d", (int) (1 + mesh_random(&seed) % 900));
            blob_text(&file, "\n");
        }
        int came = outcome(mesh_write("scribble.obj", file.bytes, file.size), false);
        assert_true(came == READ || came == REFUSED);
    }
}

static void keeps_to_its_memory(void **state) {
    (void) state;
    if (is_sanitized()) skip();
    mesh_write("hole.ply", "ply\n", 4); /* a hole of a gigabyte behind it */
    assert_int_equal(truncate(mesh_path("hole.ply"), 1 << 30), 0);
    expect(mesh_path("hole.ply"), REFUSED);
}

/* ---- Good files, to be cut and damaged --------------------------------------------------------*/

static void good_obj(blob *to) {
    blob_text(
        to,
        "# small\nmtllib a.mtl\no x\nv 0 0 0\nv 1.5 0 0 1\r\nv 1e0 1 0 .5 .5 .5\nv 0 +1 \\\n-0.25\n"
        "vt 0 0\nvn 0 0 1\nusemtl b\ns 1\nf 1 2 3\nf 1/1 3/1 4/1\nf -1//1 -2//1 -3//1\n"
        "f 1/1/1 2/1/1 \\\n 4/1/1\n");
}

static void good_ply(blob *to, int format) {
    static const char *const names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    bool big = format == 2;
    blob_text(to,
              "ply\nformat %s 1.0\ncomment a\nelement vertex 4\nproperty float x\n"
              "property double y\nproperty short z\nproperty list uchar uchar l\nelement face 2\n"
              "property uchar q\nproperty list uchar int vertex_indices\nelement edge 1\n"
              "property uint a\nend_header\n",
              names[format]);
    for (int i = 0; i < 4; i++) {
        if (format == 0) {
            blob_text(to, "%d %g %d 1 7\n", i % 2, i / 2 + .25, -i);
            continue;
        }
        blob_float(to, (float) (i % 2), big);
        blob_double(to, i / 2 + .25, big);
        blob_bytes(to, (uint64_t) -i, 2, big);
        blob_bytes(to, 0x701, 2, false);
    }
    for (int i = 0; i < 2; i++) {
        if (format == 0) {
            blob_text(to, i ? "5 4 0 1 3 2\n" : "5 3 0 1 2\n");
            continue;
        }
        blob_bytes(to, (uint64_t) (0x305 + 0x100 * i), 2, false);
        static const uint8_t corners[2][4] = {{0, 1, 2, 0}, {0, 1, 3, 2}};
        for (int k = 0; k < 3 + i; k++) blob_bytes(to, corners[i][k], 4, big);
    }
    if (format == 0)
        blob_text(to, "9\n");
    else
        blob_bytes(to, 9, 4, big);
}

static void good_stl_text(blob *to) {
    blob_text(to, "solid a\n");
    for (int i = 0; i < 2; i++)
        blob_text(to, "facet normal 0 0 1\n outer loop\n  vertex 0 0 %d\n  vertex 1.5 0 0\n"
                      "  vertex 0 1e0 0\n endloop\nendfacet\n", i);
    blob_text(to, "endsolid\n");
}

static void good_stl_binary(blob *to) {
    blob_text(to, "%-80s", "a");
    blob_bytes(to, 2, 4, false);
    for (int i = 0; i < 24; i++) {
        blob_float(to, (float) i, false);
        if (i % 12 == 11) blob_bytes(to, 0, 2, false);
    }
}

static void good_off(blob *to) {
    blob_text(to, "COFF # small\n4 2 0\n\n0 0 0 255 0 0 255\n1.5 0 0 1 0 0\n# c\n1 1e0 0 7\n"
                  "0 -1 0.25 1 1 1 1\n3 0 1 2 255 0 0\n4 0 1 2 3\n");
}

enum { FORMATS = 7 };

static const char *make_good(int format, blob *to) {
    static const char *const names[FORMATS] = {"a.obj", "a.ply", "l.ply", "b.ply", "t.stl", "b.stl",
                                               "a.off"};
    to->size = 0;
    if (format == 0) good_obj(to);
    if (format >= 1 && format <= 3) good_ply(to, format - 1);
    if (format == 4) good_stl_text(to);
    if (format == 5) good_stl_binary(to);
    if (format == 6) good_off(to);
    return names[format];
}

/* How many of the OBJ's faces a prefix has whole. The last may lack its newline, not a corner. */
static size_t obj_faces_before(size_t size) {
    static const char *const ends[] = {"f 1 2 3", "f 1/1 3/1 4/1", "f -1//1 -2//1 -3//1",
                                       "f 1/1/1 2/1/1 \\\n 4/1/1"};
    size_t count = 0;
    file.bytes[file.size] = 0;
    for (int i = 0; i < 4; i++)
        count += (size_t) (strstr(file.bytes, ends[i]) - file.bytes) + strlen(ends[i]) <= size;
    return count;
}

static void check_prefix(int format, const char *path, size_t size, const cli_mesh *whole) {
    cli_mesh mesh;
    cli_error error;
    if (!cli_mesh_read(path, &mesh, &error)) {
        mesh_check_refusal(path, &mesh, &error);
        return;
    }
    size_t triangles = whole->triangle_count;
    if (format == 0) triangles = obj_faces_before(size);
    /* Only OBJ has prefixes that are whole files; of the others one may miss the last newline. */
    if (format != 0) assert_true(size + 1 == file.size && file.bytes[size] == '\n');
    assert_int_equal(mesh.triangle_count, triangles);
    assert_true(triangles > 0);
    mesh.triangle_count = whole->triangle_count;
    assert_int_equal(mesh.vertex_count, whole->vertex_count);
    assert_memory_equal(mesh.indices, whole->indices, 12 * triangles);
    mesh.triangle_count = triangles;
    cli_mesh some = *whole;
    some.triangle_count = triangles;
    assert_true(mesh_same(&mesh, &some));
    cli_mesh_free(&mesh);
}

/* `f 1/1 3/1 4/1` cut to `f 1/1 3/1 4` is a face of its own right, and the same triangle; cut after
 * a slash it is none. What a cut leaves is thus an error or the mesh as far as it goes. */
static void never_reads_a_cut_file_wrong(void **state) {
    (void) state;
    for (int format = 0; format < FORMATS; format++) {
        const char *name = make_good(format, &file);
        cli_mesh whole = mesh_read_good(mesh_write(name, file.bytes, file.size));
        int read = 0;
        for (size_t size = 1; size < file.size; size++) {
            const char *path = mesh_write(name, file.bytes, size);
            cli_mesh probe;
            cli_error error;
            if (format == 0 && cli_mesh_read(path, &probe, &error)) {
                read++;
                assert_in_range(probe.triangle_count, 1, 4);
                assert_memory_equal(probe.indices, whole.indices, 12 * probe.triangle_count);
                assert_in_range(probe.triangle_count, obj_faces_before(size),
                                obj_faces_before(size) + 1);
                cli_mesh_free(&probe);
                continue;
            }
            check_prefix(format, path, size, &whole);
        }
        assert_true(format != 0 || read > 10);
        mesh_write(name, file.bytes, file.size);
        cli_mesh_free(&whole);
    }
}

static void refuses_what_trails(void **state) {
    (void) state;
    for (int format = 1; format < FORMATS; format++) {
        const char *name = make_good(format, &file);
        file.bytes[file.size] = format == 2 || format == 3 || format == 5 ? 0 : '1';
        const char *path = mesh_write(name, file.bytes, file.size + 1);
        cli_mesh mesh;
        cli_error error;
        assert_false(cli_mesh_read(path, &mesh, &error));
        mesh_check_refusal(path, &mesh, &error);
    }
}

/* ---- Damage -----------------------------------------------------------------------------------*/

static void splice(blob *to, size_t at, size_t removed, const char *put, size_t length) {
    if (at > to->size) at = to->size;
    if (removed > to->size - at) removed = to->size - at;
    memmove(to->bytes + at + length, to->bytes + at + removed, to->size - at - removed);
    memcpy(to->bytes + at, put, length);
    to->size += length - removed;
}

static void damage(blob *to, uint64_t *seed) {
    static const char *const words[] = {"-1",
                                        "0",
                                        "4294967296",
                                        "1e999",
                                        "nan",
                                        "\\\n",
                                        "\r\n",
                                        "\n",
                                        "99",
                                        " ",
                                        "list",
                                        "#",
                                        "/",
                                        "property",
                                        "65537",
                                        "1e-999",
                                        "end_header\n",
                                        "0x1",
                                        "3",
                                        "f 1 2 3 4 5 6\n",
                                        "ply\n"};
    size_t at = to->size ? mesh_random(seed) % to->size : 0;
    uint64_t r = mesh_random(seed);
    char copy[32], byte = (char) (r >> 8);
    switch (r % 6) {
    case 0: splice(to, at, 1, &byte, 1); break;
    case 1: byte = (char) (to->bytes[at] ^ 1 << (r >> 8) % 8), splice(to, at, 1, &byte, 1); break;
    case 2: splice(to, at, (r >> 8) % 9, "", 0); break;
    case 3: splice(to, at, 0, &byte, 1); break;
    case 4: {
        const char *word = words[(r >> 8) % (sizeof words / sizeof *words)];
        splice(to, at, (r >> 16) % 3, word, strlen(word));
        break;
    }
    default: {
        size_t from = mesh_random(seed) % (to->size + 1), length = (r >> 8) % 32;
        if (length > to->size - from) length = to->size - from;
        memcpy(copy, to->bytes + from, length);
        splice(to, at, (r >> 16) % 2 ? length : 0, copy, length);
    }
    }
}

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double) now.tv_sec + 1e-9 * (double) now.tv_nsec;
}

/* MESH_MUTATIONS sets another number of them, for a longer run. */
static void outlives_damage(void **state) {
    (void) state;
    const char *wanted = getenv("MESH_MUTATIONS");
    long mutations = wanted ? atol(wanted) : 20000;
    double start = seconds();
    for (int format = 0; format < FORMATS; format++) {
        const char *name = make_good(format, &file);
        uint64_t seed = 1000 + (uint64_t) format;
        long read = 0;
        for (long i = 0; i < mutations; i++) {
            memcpy(mutant.bytes, file.bytes, file.size);
            mutant.size = file.size;
            for (uint64_t n = 1 + mesh_random(&seed) % 3; n > 0; n--) damage(&mutant, &seed);
            const char *path = mesh_write(name, mutant.bytes, mutant.size);
            cli_mesh mesh;
            cli_error error;
            bool ok = i % 2 ? cli_mesh_read_uvs(path, &mesh, &error)
                            : cli_mesh_read(path, &mesh, &error);
            if (ok) {
                mesh_check(&mesh);
                /* No file makes more of itself than three triangles for a byte. */
                assert_true(mesh.triangle_count <= 3 * mutant.size);
                for (size_t v = 0; mesh.uvs && v < 2 * mesh.vertex_count; v++)
                    assert_true(isfinite(mesh.uvs[v]));
                read++;
            } else {
                mesh_check_refusal(path, &mesh, &error);
            }
            cli_mesh_free(&mesh);
        }
        print_message("%s: %ld of %ld mutants read\n", name, read, mutations);
        assert_true(read > 0 && read < mutations);
    }
    if (!wanted) assert_true(seconds() - start < 120); /* 4 s on an idle core */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(outlives_shared_files),
        cmocka_unit_test(is_not_impressed_by_counts),
        cmocka_unit_test(keeps_lines_and_faces_in_bounds),
        cmocka_unit_test(keeps_tiling_in_bounds),
        cmocka_unit_test(keeps_to_its_memory),
        cmocka_unit_test(never_reads_a_cut_file_wrong),
        cmocka_unit_test(refuses_what_trails),
        cmocka_unit_test(outlives_damage),
    };
    return cmocka_run_group_tests(tests, mesh_folder_make, mesh_folder_remove);
}
