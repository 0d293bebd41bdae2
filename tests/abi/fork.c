/* fork(): the child may not use the parent's handle and is told so; it can make a handle of its own
 * and gets the same bits, where the method does not trace rays; the parent is none the wiser. */
#include <sys/wait.h>
#include <unistd.h>

#include "abi/plain.h"

static const plain_api api = PLAIN_LINKED;

static int use_parents(softshadow *handle, float *v) {
    softshadow_points batch = SOFTSHADOW_POINTS_INIT;
    softshadow_stats stats = SOFTSHADOW_STATS_INIT;
    float point[3] = {0, 0, 0};
    batch.positions = point, batch.count = 1;
    if (softshadow_query_visibility(handle, &batch, v) != SOFTSHADOW_E_STATE) return 10;
    if (v[0] == v[0]) return 11; /* NaN */
    if (!strstr(softshadow_last_message(handle), "fork")) return 12;
    if (softshadow_build_maps(handle, NULL) != SOFTSHADOW_E_STATE) return 13;
    if (softshadow_remove_mesh(handle, 0) != SOFTSHADOW_E_STATE) return 14;
    if (softshadow_get_stats(handle, &stats) != SOFTSHADOW_E_STATE) return 15;
    softshadow_destroy(handle); /* allowed, and must not hang on the parent's threads */
    return 0;
}

/* The child's exit status: 0, or which step went wrong. */
static int child(softshadow *parents, const char *method, const float *want) {
    static float v[PLAIN_POINTS];
    alarm(20); /* a hang is an answer, too */
    const int wrong = use_parents(parents, v);
    if (wrong) return wrong;
    softshadow *own = NULL;
    if (plain_scene(&api, &own, NULL) != SOFTSHADOW_OK) return 20;
    const softshadow_status status = plain_ask(&api, own, method, v);
    const int rays = strcmp(method, "raytrace") == 0;
    if (status == SOFTSHADOW_E_UNSUPPORTED && (rays || strcmp(method, "auto") == 0)) {
        if (!strstr(softshadow_last_message(own), "fork")) return 21;
    } else if (rays) {
        return 22; /* Embree commits through TBB, which may hang after fork: refused */
    } else if (status != SOFTSHADOW_OK) {
        fprintf(stderr, "%s\n", softshadow_last_message(own));
        return 23;
    } else if (memcmp(v, want, sizeof v) != 0 && strcmp(method, "auto") != 0) {
        return 24;
    }
    softshadow_destroy(own);
    return 0;
}

static void try_method(const char *method) {
    static float want[PLAIN_POINTS], after[PLAIN_POINTS];
    softshadow *handle = NULL;
    REQUIRE(plain_scene(&api, &handle, NULL) == SOFTSHADOW_OK, "scene");
    REQUIRE(plain_ask(&api, handle, method, want) == SOFTSHADOW_OK, "%s: %s", method,
            softshadow_last_message(handle));
    for (int i = 0; i < 5; i++) {
        fflush(NULL);
        const pid_t pid = fork();
        REQUIRE(pid >= 0, "fork");
        if (pid == 0) _exit(child(handle, method, want));
        int status = 0;
        REQUIRE(waitpid(pid, &status, 0) == pid, "waitpid");
        REQUIRE(WIFEXITED(status), "%s: the child died of signal %d", method, WTERMSIG(status));
        REQUIRE(WEXITSTATUS(status) == 0, "%s: step %d of the child", method, WEXITSTATUS(status));
        REQUIRE(plain_ask(&api, handle, method, after) == SOFTSHADOW_OK, "%s, in the parent: %s",
                method, softshadow_last_message(handle));
        REQUIRE(memcmp(want, after, sizeof want) == 0, "%s: the parent answers otherwise", method);
    }
    softshadow_destroy(handle);
}

int main(void) {
    const char *names[64];
    if (plain_sanitized("another thread may hold the sanitizer's allocator at fork()"))
        return PLAIN_SKIP;
    const unsigned n = plain_methods(&api, names);
    for (unsigned i = 0; i < n; i++) try_method(names[i]);
    printf("%u methods, 5 children each\n", n);
    return 0;
}
