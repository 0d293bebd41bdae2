/* A host that does without: the library is loaded when it is there, and its version checked. Only
 * the header is needed to build this; link with -ldl alone.
 *
 *     ./05_dlopen [PATH_OF_LIBRARY]
 *
 * Exit status: 0 asked and answered, 3 the library is not there (a host would go on without). */
#include <dlfcn.h>
#include <softshadow.h>
#include <stdio.h>

/* The calls a host uses, with the very types the header declares. */
static struct {
    uint32_t (*version)(void);
    softshadow_status (*create)(softshadow **, const softshadow_options *);
    void (*destroy)(softshadow *);
    softshadow_status (*add_mesh)(softshadow *, const softshadow_mesh *, uint32_t *);
    softshadow_status (*set_light)(softshadow *, const softshadow_light *);
    softshadow_status (*build_maps)(softshadow *, const softshadow_build *);
    softshadow_status (*query_visibility)(softshadow *, const softshadow_points *, float *);
    const char *(*last_message)(const softshadow *);
} ss;

static int load(const char *path) {
    static const struct {
        const char *name;
        void *into;
    } calls[] = {
        {"softshadow_version", &ss.version},
        {"softshadow_create", &ss.create},
        {"softshadow_destroy", &ss.destroy},
        {"softshadow_add_mesh", &ss.add_mesh},
        {"softshadow_set_light", &ss.set_light},
        {"softshadow_build_maps", &ss.build_maps},
        {"softshadow_query_visibility", &ss.query_visibility},
        {"softshadow_last_message", &ss.last_message},
    };
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "no soft shadows: %s\n", dlerror()), 0;
    for (size_t i = 0; i < sizeof calls / sizeof *calls; i++) {
        void *call = dlsym(library, calls[i].name);
        if (!call) return fprintf(stderr, "no soft shadows: %s\n", dlerror()), 0;
        *(void **)calls[i].into = call;
    }
    const uint32_t version = ss.version();
    if (version / 10000 != SOFTSHADOW_VERSION_MAJOR || version < SOFTSHADOW_VERSION)
        return fprintf(stderr, "no soft shadows: version %u, %u or a later 1.x is wanted\n",
                       (unsigned)version, (unsigned)SOFTSHADOW_VERSION),
               0;
    return 1;
}

int main(int argc, char **argv) {
    const float corners[] = {-1, 1, -1, 1, 1, -1, 0, 1, 1}, point[] = {0.6f, 0, 0};
    const uint32_t indices[] = {0, 1, 2};
    float visibility;
    if (!load(argc > 1 ? argv[1] : "libsoftshadow.so.1")) return 3;

    softshadow_mesh mesh = SOFTSHADOW_MESH_INIT;
    mesh.positions = corners;
    mesh.vertex_count = 3;
    mesh.indices = indices;
    mesh.triangle_count = 1;
    softshadow_light lamp = SOFTSHADOW_LIGHT_INIT;
    lamp.position[1] = 4;
    lamp.radius = 0.5;
    softshadow_points points = SOFTSHADOW_POINTS_INIT;
    points.positions = point;
    points.count = 1;
    softshadow *s;
    if (ss.create(&s, NULL) || ss.add_mesh(s, &mesh, NULL) || ss.set_light(s, &lamp) ||
        ss.build_maps(s, NULL) || ss.query_visibility(s, &points, &visibility)) {
        fprintf(stderr, "%s\n", ss.last_message(s));
        return 1;
    }
    printf("x = %.1f sees %.3f of the lamp\n", (double)point[0], (double)visibility);
    ss.destroy(s);
    return 0;
}
