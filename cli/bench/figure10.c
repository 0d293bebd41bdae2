/* softshadow bench --figure10: Lawlor's table, and the shadows it is made of as pictures. */
#include "figure10.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "../../tests/figure10.h"
#include "../image/image.h"
#include "../output.h"
#include "../render/shade.h"
#include "../text_buffer.h"

enum { S = FIGURE10_SIDE, WIDE = S * FIGURE10_SIDES, PATH_ROOM = 4096 };

/* One picture a row: maps of 16 .. 128 from left to right, shadows above, errors below. */
typedef struct gallery {
    const char *folder;
    const image_module *module;
    float *pixels; /* WIDE x 2 S, grey, as a screen wants it */
    cli_error *error;
} gallery;

static bool save(gallery *g, const char *name, const float *pixels, uint32_t width,
                 uint32_t height) {
    static const char *const metadata[] = {"Software", "softshadow bench --figure10", NULL};
    const image_plane grey = {"Y", pixels, 1};
    const image_picture picture = {.width = width, .height = height, .planes = &grey,
                                   .plane_count = 1, .srgb = true, .metadata = metadata};
    char path[PATH_ROOM], message[IMAGE_WHY] = "";
    cli_output output = {0};
    void *bytes = NULL;
    size_t size = 0;
    if (snprintf(path, sizeof path, "%s/%s.png", g->folder, name) >= PATH_ROOM)
        return cli_fail(g->error, CLI_FAILED, "--figure10: the name is too long");
    if (!g->module->encode(&picture, IMAGE_PNG, &bytes, &size, message))
        return cli_fail(g->error, CLI_FAILED, "%.200s: %.200s", path, message);
    const bool done = cli_output_open(&output, path, g->error) &&
                      cli_output_write(&output, bytes, size, g->error) &&
                      cli_output_commit(&output, g->error);
    cli_output_abandon(&output);
    g->module->free_bytes(bytes);
    return done;
}

/* Shadows as light on a screen; errors as in figure 11, grey where there is none, lighter where too
 * much light is seen. The picture's top is where y is high. */
static bool show(void *ctx, const figure10_row *row, uint32_t resolution, const float *visibility,
                 const float *truth) {
    gallery *g = ctx;
    int column = 0;
    while (16u << column < resolution) column++;
    for (int y = 0; y < S; y++) {
        for (int x = 0; x < S; x++) {
            const int from = (S - 1 - y) * S + x, to = y * WIDE + column * S + x;
            g->pixels[to] = shade_srgb(visibility[from]);
            g->pixels[to + S * WIDE] = .5f + (visibility[from] - truth[from]) / 2;
        }
    }
    if (row) return column + 1 < FIGURE10_SIDES || save(g, row->method, g->pixels, WIDE, 2 * S);
    for (int y = 1; y < S; y++)
        memmove(g->pixels + y * S, g->pixels + y * WIDE, S * sizeof *g->pixels);
    return save(g, "truth", g->pixels, S, S);
}

/* ---- The table ------------------------------------------------------------------------------*/

static void print(const figure10 *f) {
    static const char *const part[] = {"", "  outer penumbra", "  inner penumbra"};
    printf("RMS error in 0..255, the paper's in parentheses\n%-18s", "map");
    for (int s = 0; s < FIGURE10_SIDES; s++) printf("%7d^2      ", 16 << s);
    for (uint32_t r = 0; r < f->row_count; r++) {
        const figure10_row *row = &f->rows[r];
        if (r == FIGURE10_PRINTED)
            printf("\n%-18s %6.1f (33.5)\n%-18s %6.1f (12.0)\n\nnot in the paper", "no map, hard",
                   f->hard_exact, "16 random samples", f->sixteen);
        printf("\n%-18s", row->method);
        for (int s = 0; s < FIGURE10_SIDES; s++) {
            printf(" %6.1f", row->ours[s]);
            if (row->printed) printf(" (%4.1f) ", row->paper[s]);
            else printf("        ");
        }
        printf("%s", part[row->part]);
    }
    printf("\n");
}

static bool keep(const figure10 *f, const char *folder, cli_error *error) {
    cli_text text = {0};
    cli_output output = {0};
    char path[PATH_ROOM];
    cli_text_printf(&text, "method,resolution,rms,paper\n");
    for (uint32_t r = 0; r < f->row_count; r++) {
        for (int s = 0; s < FIGURE10_SIDES; s++) {
            const figure10_row *row = &f->rows[r];
            cli_text_printf(&text, "%s,%d,%.2f,", row->method, 16 << s, row->ours[s]);
            if (row->printed) cli_text_printf(&text, "%.1f", row->paper[s]);
            cli_text_printf(&text, "\n");
        }
    }
    cli_text_printf(&text, "hard exact,,%.2f,33.5\n16 samples,,%.2f,12.0\n", f->hard_exact,
                    f->sixteen);
    bool done = !text.failed || cli_fail(error, CLI_FAILED, "memory ran out");
    if (done && snprintf(path, sizeof path, "%s/figure10.csv", folder) >= PATH_ROOM)
        done = cli_fail(error, CLI_FAILED, "--figure10: the name is too long");
    done = done && cli_output_open(&output, path, error) &&
           cli_output_write(&output, text.begin, text.length, error) &&
           cli_output_commit(&output, error);
    cli_output_abandon(&output);
    cli_text_free(&text);
    return done;
}

bool bench_figure10(const char *folder, cli_error *error) {
    gallery g = {.folder = folder, .module = image_load(error), .error = error};
    figure10 f;
    if (!g.module) return false;
    if (mkdir(folder, 0777) != 0 && errno != EEXIST)
        return cli_fail(error, CLI_FAILED, "--figure10=%.200s: cannot be made: %s", folder,
                        strerror(errno));
    g.pixels = malloc(2 * S * WIDE * sizeof *g.pixels);
    if (!g.pixels) return cli_fail(error, CLI_FAILED, "memory ran out");
    error->text[0] = 0;
    const char *why = figure10_measure(&f, show, &g);
    free(g.pixels);
    if (why) return error->text[0] ? false : cli_fail(error, CLI_FAILED, "%s", why);
    print(&f);
    return keep(&f, folder, error);
}
