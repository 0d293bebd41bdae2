/* fork(): the child may not use the parent's handle and is told so; it can make a handle of its own
 * and gets the same bits, where the method does not trace rays; the parent is none the wiser. A
 * child that calls exec() is a process like any other: the same bits, rays included.
 *
 * fork [CHILDREN]: so many of each kind for each method; 5 if not said. fork "method": what exec()
 * runs; the answers leave on stdout. */
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

/* In a process of its own, from nothing. */
static int from_nothing(const char *method) {
    static float v[PLAIN_POINTS];
    plain_run(&api, method, v);
    return fwrite(v, sizeof v, 1, stdout) == 1 && fflush(stdout) == 0 ? 0 : 1;
}

static void try_exec(const char *method, const float *want) {
    static float v[PLAIN_POINTS];
    int ends[2], status = 0;
    REQUIRE(pipe(ends) == 0, "pipe");
    fflush(NULL);
    const pid_t pid = fork();
    REQUIRE(pid >= 0, "fork");
    if (pid == 0) {
        alarm(20);
        dup2(ends[1], 1);
        close(ends[0]), close(ends[1]);
        execl("/proc/self/exe", "fork", "method", method, (char *)NULL);
        _exit(30);
    }
    close(ends[1]);
    FILE *answers = fdopen(ends[0], "rb");
    REQUIRE(answers && fread(v, sizeof v, 1, answers) == 1, "%s, after exec: no answers", method);
    fclose(answers);
    REQUIRE(waitpid(pid, &status, 0) == pid && WIFEXITED(status) && WEXITSTATUS(status) == 0,
            "%s, after exec: status %d", method, status);
    REQUIRE(memcmp(v, want, sizeof v) == 0, "%s, after exec: other answers", method);
}

static void try_method(const char *method, int children) {
    static float want[PLAIN_POINTS], after[PLAIN_POINTS];
    softshadow *handle = NULL;
    REQUIRE(plain_scene(&api, &handle, NULL) == SOFTSHADOW_OK, "scene");
    REQUIRE(plain_ask(&api, handle, method, want) == SOFTSHADOW_OK, "%s: %s", method,
            softshadow_last_message(handle));
    for (int i = 0; i < children; i++) {
        fflush(NULL);
        const pid_t pid = fork();
        REQUIRE(pid >= 0, "fork");
        if (pid == 0) _exit(child(handle, method, want));
        int status = 0;
        REQUIRE(waitpid(pid, &status, 0) == pid, "waitpid");
        REQUIRE(WIFEXITED(status), "%s: the child died of signal %d", method, WTERMSIG(status));
        REQUIRE(WEXITSTATUS(status) == 0, "%s: step %d of the child", method, WEXITSTATUS(status));
        try_exec(method, want);
        REQUIRE(plain_ask(&api, handle, method, after) == SOFTSHADOW_OK, "%s, in the parent: %s",
                method, softshadow_last_message(handle));
        REQUIRE(memcmp(want, after, sizeof want) == 0, "%s: the parent answers otherwise", method);
    }
    softshadow_destroy(handle);
}

int main(int argc, char **argv) {
    const char *names[64];
    if (argc > 2) return from_nothing(argv[2]);
    const int children = argc > 1 ? atoi(argv[1]) : 5;
    if (plain_sanitized("another thread may hold the sanitizer's allocator at fork()"))
        return PLAIN_SKIP;
    const unsigned n = plain_methods(&api, names);
    for (unsigned i = 0; i < n; i++) try_method(names[i], children);
    printf("%u methods, %d children and %d programs each\n", n, children, children);
    return 0;
}
