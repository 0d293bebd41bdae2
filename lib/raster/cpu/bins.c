/* A counting sort in two passes over chunks of items. */
#include "raster/cpu/bins.h"

#include <stdlib.h>

#include "base/memory.h"
#include "base/status.h"

#define CHUNK 4096

typedef struct builder {
    ss_bins *bins;
    size_t n;
    uint32_t *count; /* chunk x band: how many, then where they go */
    ss_bin_span *span; /* of each item */
    ss_bin_rows *rows;
    ss_bin_spans *spans;
    const void *ctx;
    bool fill;
} builder;

static void find_spans(const builder *b, size_t begin, size_t end) {
    if (b->spans) {
        b->spans(b->ctx, begin, end, b->span + begin);
        return;
    }
    for (size_t i = begin; i < end; i++) {
        int32_t first, last;
        uint16_t *span = b->span[i];
        span[0] = span[1] = 0;
        if (!b->rows(b->ctx, i, &first, &last)) continue;
        span[0] = (uint16_t)(first / SS_BAND), span[1] = (uint16_t)(last / SS_BAND + 1);
    }
}

static softshadow_status pass(void *ctx, uint64_t begin, uint64_t end) {
    const builder *b = ctx;
    for (uint64_t chunk = begin; chunk < end; chunk++) {
        uint32_t *count = b->count + chunk * b->bins->bands;
        const size_t last_item = (chunk + 1) * CHUNK < b->n ? (chunk + 1) * CHUNK : b->n;
        if (!b->fill) find_spans(b, chunk * CHUNK, last_item);
        for (size_t i = chunk * CHUNK; i < last_item; i++) {
            const uint16_t *span = b->span[i];
            const uint32_t first = span[0] & (SS_BIN_MARKED - 1), marked = span[0] & SS_BIN_MARKED;
            const uint32_t item = (uint32_t)i | (marked ? SS_BIN_MARK : 0);
            for (uint32_t band = first; band < span[1]; band++) {
                if (b->fill) b->bins->item[count[band]++] = item;
                else count[band]++;
            }
        }
    }
    return SOFTSHADOW_OK;
}

static bool place(builder *b, size_t chunks) {
    size_t sum = 0;
    for (uint32_t band = 0; band < b->bins->bands; band++) {
        b->bins->first[band] = (uint32_t)sum;
        for (size_t chunk = 0; chunk < chunks; chunk++) {
            uint32_t *count = &b->count[chunk * b->bins->bands + band];
            const uint32_t n = *count;
            *count = (uint32_t)sum;
            sum += n;
        }
    }
    b->bins->first[b->bins->bands] = (uint32_t)sum;
    b->bins->item = sum <= UINT32_MAX ? ss_alloc_any(sum, sizeof *b->bins->item) : NULL;
    return b->bins->item != NULL;
}

static int fuller(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? 1 : x > y ? -1 : 0;
}

static bool put_in_order(ss_bins *bins) {
    uint64_t *key = ss_alloc_any(bins->bands, sizeof *key); /* how many, then which */
    bins->order = ss_alloc_any(bins->bands, sizeof *bins->order);
    const bool fine = key && bins->order;
    for (uint32_t i = 0; i < bins->bands && fine; i++)
        key[i] = (uint64_t)(bins->first[i + 1] - bins->first[i]) << 32 | i;
    if (fine) qsort(key, bins->bands, sizeof *key, fuller);
    for (uint32_t i = 0; i < bins->bands && fine; i++) bins->order[i] = (uint32_t)key[i];
    ss_free(key);
    return fine;
}

softshadow_status ss_bins_build(ss_bins *bins, size_t n, uint32_t resolution, ss_bin_rows *rows,
                                ss_bin_spans *spans, const void *ctx, ss_pool *pool) {
    *bins = (ss_bins){.bands = (resolution + SS_BAND - 1) / SS_BAND};
    const size_t chunks = (n + CHUNK - 1) / CHUNK;
    builder b = {.bins = bins, .n = n, .rows = rows, .spans = spans, .ctx = ctx};
    bins->first = ss_alloc(bins->bands + 1, sizeof *bins->first);
    b.count = ss_alloc(chunks * bins->bands, sizeof *b.count);
    b.span = ss_alloc_any(n, sizeof *b.span);
    softshadow_status status = SOFTSHADOW_OK;
    if (!bins->first || !b.count || !b.span) status = SOFTSHADOW_E_MEMORY;
    if (!status) status = ss_parallel_for(pool, chunks, 1, pass, &b);
    if (!status && !place(&b, chunks)) status = SOFTSHADOW_E_MEMORY;
    if (!status && !put_in_order(bins)) status = SOFTSHADOW_E_MEMORY;
    b.fill = true;
    if (!status) status = ss_parallel_for(pool, chunks, 1, pass, &b);
    ss_free(b.count), ss_free(b.span);
    if (status) ss_bins_free(bins);
    if (status == SOFTSHADOW_E_MEMORY)
        return ss_fail(status, "map: out of memory for %zu triangles", n);
    return status;
}

void ss_bins_free(ss_bins *bins) {
    ss_free(bins->first);
    ss_free(bins->item);
    ss_free(bins->order);
    *bins = (ss_bins){0};
}
