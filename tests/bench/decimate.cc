/* Our coarser levels beside those of OpenMesh's decimater with quadrics, the usual choice: seconds,
 * and how far the mesh's own vertices are from each level.
 *
 *     make tests/bench/decimate && tests/bench/decimate [MESH.obj | RINGS] ...
 *
 * RINGS makes a bumpy sphere of 4 RINGS^2 triangles. Fails where our level strays more. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

extern "C" {
#include "base/clock.h"
#include "base/memory.h"
#include "topology/closest.h"
#include "topology/decimate.h"
}

namespace {

struct soup {
    std::vector<float> vertices;
    std::vector<uint32_t> triangles;
};

soup bumpy_sphere(uint32_t rings) {
    const uint32_t around = 2 * rings;
    soup s;
    for (uint32_t i = 0; i <= rings; i++) {
        for (uint32_t j = 0; j < around; j++) {
            const double a = M_PI * i / rings, b = 2 * M_PI * j / around;
            const bool pole = i == 0 || i == rings;
            const double x = pole ? 0 : sin(a) * cos(b), y = pole ? 0 : sin(a) * sin(b), z = cos(a);
            const double bump =
                sin(11 * x + 3 * z) * sin(13 * y) + .3 * sin(31 * z + 17 * x) * cos(29 * y);
            for (const double p : {x, y, z}) s.vertices.push_back((float)((1 + .05 * bump) * p));
        }
    }
    const auto at = [=](uint32_t i, uint32_t j) {
        return i * around + (i == 0 || i == rings ? 0 : j % around);
    };
    for (uint32_t i = 0; i < rings; i++) {
        for (uint32_t j = 0; j < around; j++) {
            const uint32_t a = at(i, j), b = at(i, j + 1), c = at(i + 1, j), d = at(i + 1, j + 1);
            if (i > 0) s.triangles.insert(s.triangles.end(), {a, c, b});
            if (i + 1 < rings) s.triangles.insert(s.triangles.end(), {b, c, d});
        }
    }
    return s;
}

/* Plain triangles "f 1 2 3" or "f 1/1/1 ..." of a file that is trusted. */
soup read_obj(const char *path) {
    soup s;
    char line[512];
    FILE *file = fopen(path, "r");
    if (!file) {
        perror(path);
        exit(2);
    }
    while (fgets(line, sizeof line, file)) {
        float p[3];
        if (sscanf(line, "v %f %f %f", &p[0], &p[1], &p[2]) == 3) {
            s.vertices.insert(s.vertices.end(), p, p + 3);
        } else if (line[0] == 'f') {
            char *word = line + 1;
            for (int k = 0; k < 3; k++) {
                s.triangles.push_back((uint32_t)strtoul(word, &word, 10) - 1);
                while (*word && *word != ' ') word++;
            }
        }
    }
    fclose(file);
    return s;
}

/* Into [0, 1], as the library does before it simplifies. */
void normalize(soup &s) {
    float low[3] = {INFINITY, INFINITY, INFINITY}, side = 0;
    for (size_t i = 0; i < s.vertices.size(); i++) low[i % 3] = std::min(low[i % 3], s.vertices[i]);
    for (size_t i = 0; i < s.vertices.size(); i++) {
        side = std::max(side, s.vertices[i] - low[i % 3]);
    }
    for (size_t i = 0; i < s.vertices.size(); i++) {
        s.vertices[i] = (s.vertices[i] - low[i % 3]) / side;
    }
}

double strays(const soup &from, const soup &to) {
    ss_closest *closest;
    if (ss_closest_create(&closest, to.vertices.data(), to.triangles.data(),
                          to.triangles.size() / 3)) {
        exit(2);
    }
    double sum = 0;
    uint32_t hint = SS_NO_HINT;
    for (size_t i = 0; i < from.vertices.size(); i += 3) {
        sum += ss_closest_distance2(closest, &from.vertices[i], INFINITY, &hint);
    }
    ss_closest_destroy(closest);
    return sqrt(sum / (double)(from.vertices.size() / 3));
}

typedef OpenMesh::TriMesh_ArrayKernelT<> mesh_type;

mesh_type to_openmesh(const soup &s) {
    mesh_type mesh;
    for (size_t i = 0; i < s.vertices.size(); i += 3) {
        mesh.add_vertex(mesh_type::Point(s.vertices[i], s.vertices[i + 1], s.vertices[i + 2]));
    }
    for (size_t i = 0; i < s.triangles.size(); i += 3) {
        mesh.add_face(mesh_type::VertexHandle((int)s.triangles[i]),
                      mesh_type::VertexHandle((int)s.triangles[i + 1]),
                      mesh_type::VertexHandle((int)s.triangles[i + 2]));
    }
    return mesh;
}

soup from_openmesh(const mesh_type &mesh) {
    soup s;
    for (const auto &v : mesh.vertices()) {
        for (int k = 0; k < 3; k++) s.vertices.push_back(mesh.point(v)[k]);
    }
    for (const auto &f : mesh.faces()) {
        for (const auto &v : mesh.fv_range(f)) s.triangles.push_back((uint32_t)v.idx());
    }
    return s;
}

void decimate_openmesh(mesh_type &mesh, size_t target) {
    OpenMesh::Decimater::DecimaterT<mesh_type> decimater(mesh);
    OpenMesh::Decimater::ModQuadricT<mesh_type>::Handle quadric;
    decimater.add(quadric);
    decimater.module(quadric).unset_max_err();
    decimater.initialize();
    decimater.decimate_to_faces(0, target);
    mesh.garbage_collection();
}

bool compare(const char *name, soup s, ss_pool *pool) {
    normalize(s);
    ss_mesh_levels levels;
    bool good = true;
    double start = ss_clock();
    if (ss_decimate(&levels, s.vertices.data(), s.vertices.size() / 3, s.triangles.data(),
                    s.triangles.size() / 3, pool, nullptr)) {
        exit(2);
    }
    printf("%s: %zu triangles, all levels and distances %.3f s\n", name, s.triangles.size() / 3,
           ss_clock() - start);
    start = ss_clock();
    mesh_type mesh = to_openmesh(s);
    for (uint32_t i = 0; i < levels.count; i++) {
        decimate_openmesh(mesh, levels.level[i].triangle_count);
        const double seconds = ss_clock() - start;
        const soup peer = from_openmesh(mesh);
        const double rms = strays(s, peer);
        printf("  %8zu triangles: RMS %.2e, largest %.2e; OpenMesh %8zu: RMS %.2e, %.3f s so far\n",
               levels.level[i].triangle_count, levels.level[i].deviation_rms,
               levels.level[i].deviation_max, peer.triangles.size() / 3, rms, seconds);
        good = good && levels.level[i].deviation_rms <= rms;
    }
    ss_mesh_levels_free(&levels);
    return good;
}

} // namespace

int main(int argc, char **argv) {
    softshadow_options options = SOFTSHADOW_OPTIONS_INIT;
    ss_pool *pool;
    bool good = true;
    options.threads = 1;
    if (ss_pool_create(&pool, &options)) return 2;
    for (int i = 1; i < argc; i++) {
        const unsigned long rings = strtoul(argv[i], nullptr, 10);
        good = compare(argv[i], rings ? bumpy_sphere((uint32_t)rings) : read_obj(argv[i]), pool) &&
               good;
    }
    if (argc == 1) good = compare("100", bumpy_sphere(100), pool);
    ss_pool_destroy(pool);
    return good ? 0 : 1;
}
