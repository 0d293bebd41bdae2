/* The only file that includes OpenMesh (its core: no readers, no writers). Every function catches
 * all and says what happened as a status. */
#include "topology/openmesh.h"

#include <mutex>
#include <new>
#include <vector>

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <OpenMesh/Core/System/omstream.hh>

extern "C" {
#include "base/status.h"
}

namespace {

typedef OpenMesh::TriConnectivity mesh_type;

/* OpenMesh prints what it refuses. Its streams belong to the process, and a host may use them too:
 * they are silenced while we work and left as they were. */
class silence {
  public:
    silence() : lock_(mutex()) {
        for (int i = 0; i < 3; i++) {
            enabled_[i] = stream(i).is_enabled();
            stream(i).disable();
        }
    }
    ~silence() {
        for (int i = 0; i < 3; i++) {
            if (enabled_[i]) stream(i).enable();
        }
    }
    silence(const silence &) = delete;
    silence &operator=(const silence &) = delete;

  private:
    static std::mutex &mutex() {
        static std::mutex one;
        return one;
    }
    static OpenMesh::mostream &stream(int i) {
        return i == 0 ? omerr() : i == 1 ? omlog() : omout();
    }

    std::lock_guard<std::mutex> lock_;
    bool enabled_[3];
};

uint64_t count_components(const mesh_type &mesh) {
    std::vector<bool> seen(mesh.n_faces());
    std::vector<OpenMesh::FaceHandle> waiting;
    uint64_t count = 0;
    for (const auto &seed : mesh.faces()) {
        if (seen[(size_t)seed.idx()]) continue;
        count++;
        seen[(size_t)seed.idx()] = true;
        waiting.push_back(seed);
        while (!waiting.empty()) {
            const OpenMesh::FaceHandle face = waiting.back();
            waiting.pop_back();
            for (const auto &next : mesh.ff_range(face)) {
                if (seen[(size_t)next.idx()]) continue;
                seen[(size_t)next.idx()] = true;
                waiting.push_back(next);
            }
        }
    }
    return count;
}

void count_all(ss_halfedges *out, const uint32_t *corners, size_t triangles, size_t vertices) {
    silence quiet;
    mesh_type mesh;
    mesh.reserve(vertices, triangles + triangles / 2 + vertices, triangles);
    for (size_t v = 0; v < vertices; v++) mesh.add_vertex();
    for (size_t t = 0; t < triangles; t++) {
        const auto face = mesh.add_face(OpenMesh::VertexHandle((int)corners[3 * t]),
                                        OpenMesh::VertexHandle((int)corners[3 * t + 1]),
                                        OpenMesh::VertexHandle((int)corners[3 * t + 2]));
        out->refused += !face.is_valid();
    }
    for (const auto &edge : mesh.edges()) {
        out->edges++;
        out->boundary_edges += mesh.is_boundary(edge);
    }
    for (const auto &vertex : mesh.vertices()) {
        out->nonmanifold_vertices += !mesh.is_isolated(vertex) && !mesh.is_manifold(vertex);
    }
    out->components = count_components(mesh);
}

} // namespace

softshadow_status ss_openmesh_count(ss_halfedges *out, const uint32_t *corners,
                                    size_t triangle_count, size_t vertex_count) {
    *out = ss_halfedges();
    /* OpenMesh counts half-edges in int; six per triangle is the most there can be. */
    if (triangle_count > INT32_MAX / 6 || vertex_count > INT32_MAX) {
        out->refused = triangle_count;
        return SOFTSHADOW_OK;
    }
    try {
        count_all(out, corners, triangle_count, vertex_count);
        return SOFTSHADOW_OK;
    } catch (const std::bad_alloc &) {
        return ss_fail(SOFTSHADOW_E_MEMORY, "out of memory for the half-edges of %zu triangles",
                       triangle_count);
    } catch (const std::exception &error) {
        return ss_fail(SOFTSHADOW_E_INTERNAL, "OpenMesh: %s", error.what());
    } catch (...) {
        return ss_fail(SOFTSHADOW_E_INTERNAL, "OpenMesh threw something unknown");
    }
}
