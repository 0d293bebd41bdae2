/* Drawing into the lanes' masks: single triangles by exclusive or, outlines by winding numbers. */
#ifndef SS_COVERAGE_KERNEL_DRAW_H
#define SS_COVERAGE_KERNEL_DRAW_H

#define MOST_EDGES      5  /* of a triangle clipped by two planes */
#define MOST_ROW_BLOCKS 24 /* SS_LATTICE_MOST samples */
#define BATCH           64 /* edges between two rounds over the lanes: their numbers stay in L1 */

/* Edges waiting to be drawn, with what each does in which lanes. */
typedef struct batch {
    edge edges[BATCH];
    _Alignas(64) uint16_t touched[MOST_ROW_BLOCKS][BATCH]; /* lanes, by row block */
    _Alignas(64) uint16_t positive[BATCH];                 /* lanes in which it counts +1 */
    uint32_t count;
} batch;

typedef struct walk {
    ss_group *g;
    uint32_t blocks, words, row_blocks;
    uint32_t open; /* lanes that still see some of the light */
    float rows, columns;
    _Alignas(64) float cone[4][4][SS_LANES], cone_size[4][3][SS_LANES]; /* see set_cones() */
    _Alignas(64) float row[MOST_ROW_BLOCKS * SS_BLOCK];                 /* y of every row */
    uint32_t work;   /* edges drawn since lanes were last closed */
    uint32_t uses;   /* in the list, before cancelling */
    unsigned planes; /* that are not all zero, at most */
    batch batch;
} walk;

/* ---- marking
 * -----------------------------------------------------------------------------------*/

/* Where an edge is at some heights; where rounding says it is beyond its own ends, at `end`. */
static inline vf edge_at(const edge *e, unsigned lane, vf y, vf x_low, vf x_high, vm level,
                         vf end) {
    const vf x = f_fma(f_sub(y, f_set(e->pivot[lane])), f_set(e->slope[lane]), f_set(e->x[lane]));
    return f_blend(m_andnot(m_and(f_le(x_low, x), f_le(x, x_high)), level), end, x);
}

/* Marks the cells `reach` around the edge; SLACK is for rounding. */
#define SLACK 0x1p-8f
static inline void mark_cells(const walk *w, const edge *e, unsigned lane, float x_low,
                              float x_high, float reach, uint32_t *marks) {
    const float low = e->low[lane], high = e->high[lane];
    reach += SLACK;
    if (x_high + reach < 1 || x_low - reach > w->columns) return;
    const vm level = m_from(high - low < SLACK ? 0xffff : 0); /* all of it */
    const vm rising = m_or(level, f_lt(f_set(0), f_set(e->slope[lane])));
    const vf room = f_set(reach), least = f_set(x_low), most = f_set(x_high);
    const vf lower = f_blend(rising, most, least), upper = f_blend(rising, least, most);
    for (uint32_t r = 0; r < w->row_blocks; r++) {
        const float first_row = (float)(SS_BLOCK * r + 1), last_row = (float)(SS_BLOCK * (r + 1));
        if (high + reach < first_row || low - reach > last_row) continue;
        const vf y = f_load(w->row + SS_BLOCK * r);
        const vf from = f_max(f_sub(y, room), f_set(low)), to = f_min(f_add(y, room), f_set(high));
        const vm rows = f_le(from, to);
        const vf a = edge_at(e, lane, from, least, most, level, lower),
                 b = edge_at(e, lane, to, least, most, level, upper);
        const vf left = f_sub(f_min(a, b), room), right = f_add(f_max(a, b), room);
        for (uint32_t word = 0; word < w->words; word++) {
            const vf first = f_set((float)(32 * word));
            uint32_t *at = marks + SS_BLOCK * (r * w->words + word);
            const vi cells = i_andnot(i_columns_from(f_sub(left, first), rows),
                                      i_columns_from(f_sub(right, first), rows));
            i_store(at, i_or(i_load(at), cells));
        }
    }
}

/* Marks an edge in these lanes; those that it is nowhere near to are passed over. */
static inline void mark_edge(const walk *w, const edge *e, const bounds *box, vf farthest,
                             uint32_t lanes) {
    const ss_group *g = w->g;
    const float most = SS_LATTICE_REACH + 2 * SLACK + g->blur;
    const vf before = f_set(1 - most);
    const vm away = m_or(
        m_or(f_lt(box->x_high, before), f_lt(box->y_high, before)),
        m_or(f_lt(f_set(w->columns + most), box->x_low), f_lt(f_set(w->rows + most), box->y_low)));
    lanes &= ~m_bits(away);
    if (!lanes) return;
    _Alignas(64) float x_low[SS_LANES], x_high[SS_LANES], t[SS_LANES];
    f_store(x_low, box->x_low);
    f_store(x_high, box->x_high);
    f_store(t, farthest);
    for (; lanes; lanes &= lanes - 1) {
        const unsigned i = (unsigned)__builtin_ctz(lanes);
        const float blur = t[i] > g->blur_from ? g->blur : 0;
        uint32_t *marks = ss_group_marks(g, i);
        mark_cells(w, e, i, x_low[i], x_high[i], 0.5f + blur, marks);
        mark_cells(w, e, i, x_low[i], x_high[i], SS_LATTICE_REACH + blur,
                   marks + w->blocks * SS_BLOCK);
    }
}

/* ---- single triangles
 * --------------------------------------------------------------------------*/

typedef struct polygon {
    edge edges[MOST_EDGES];
    int count;
    bounds box;
} polygon;

static inline void add_edge(const walk *w, polygon *p, const place *a, const place *b,
                            const pixel *pa, const pixel *pb, uint32_t lanes) {
    bounds box;
    set_edge(&p->edges[p->count], &box, a, b, pa, pb, w->rows / 2);
    if (w->g->marks) mark_edge(w, &p->edges[p->count], &box, f_max(a->t, b->t), lanes);
    p->count++;
    p->box.x_low = f_min(p->box.x_low, box.x_low), p->box.x_high = f_max(p->box.x_high, box.x_high);
    p->box.y_low = f_min(p->box.y_low, box.y_low), p->box.y_high = f_max(p->box.y_high, box.y_high);
}

static inline void clip_triangle(const walk *w, polygon *p, const place v[3], uint32_t lanes) {
    segment s[MOST_EDGES] = {{v[0], v[1]}, {v[1], v[2]}, {v[2], v[0]}};
    int count = clip(s, 3, f_load(w->g->slab->t_near), 0);
    count = clip(s, count, f_load(w->g->slab->t_far), 1);
    for (int i = 0; i < count; i++) {
        const pixel a = project(&s[i].a), b = project(&s[i].b);
        add_edge(w, p, &s[i].a, &s[i].b, &a, &b, lanes);
    }
}

/* Lanes in which something with these bounds can cover a sample or, with `left`, be to the left of
 * one. The margins are for rounding in x at a row. */
static inline vm touched(const walk *w, const bounds *box, int left) {
    const vf first = f_max(f_ceil(box->y_low), f_set(1));
    const vf end = f_min(f_ceil(box->y_high), f_set(w->rows + 1));
    const vm in = m_and(f_lt(first, end), f_lt(box->x_low, f_set(w->columns + 0.25f)));
    return left ? in : m_and(in, f_lt(f_set(0.75f), box->x_high));
}

/* Lanes in which something with these bounds crosses rows of a row block. */
static inline uint32_t in_row_block(const bounds *box, uint32_t row_block) {
    return m_bits(m_and(f_le(box->y_low, f_set((float)(SS_BLOCK * (row_block + 1)))),
                        f_lt(f_set((float)(SS_BLOCK * row_block + 1)), box->y_high)));
}

/* Lanes in which something with these bounds covers places of the word-th 32 columns; where it has
 * edges to the left of them only, these cancel there. The margins are those of touched(). */
static inline uint32_t in_word(const bounds *box, uint32_t word) {
    const float first = (float)(32 * word);
    return m_bits(m_and(f_lt(f_set(first + 0.75f), box->x_high),
                        f_lt(box->x_low, f_set(first + 32.25f))));
}

static inline void draw_block(const walk *w, const polygon *p, uint32_t block, uint32_t lanes) {
    const vf y = f_load(w->row + SS_BLOCK * (block / w->words));
    const uint32_t word = block % w->words;
    for (; lanes; lanes &= lanes - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(lanes);
        uint32_t *mask = ss_group_mask(w->g, lane) + SS_BLOCK * block;
        vi cover = edge_block(&p->edges[0], lane, y, word);
        for (int i = 1; i + 1 < p->count; i += 2) {
            cover = i_xor3(cover, edge_block(&p->edges[i], lane, y, word),
                           edge_block(&p->edges[i + 1], lane, y, word));
        }
        i_store(mask, i_or(i_load(mask), cover));
    }
}

static inline void draw_pair(const walk *w, const polygon *p, uint32_t block, uint32_t lanes) {
    const vf y = f_load(w->row + SS_BLOCK * (block / w->words));
    const uint32_t word = block % w->words;
    for (; lanes; lanes &= lanes - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(lanes);
        uint32_t *mask = ss_group_mask(w->g, lane) + SS_BLOCK * block;
        pair cover = edge_pair(&p->edges[0], lane, y, word);
        for (int i = 1; i + 1 < p->count; i += 2) {
            const pair a = edge_pair(&p->edges[i], lane, y, word),
                       b = edge_pair(&p->edges[i + 1], lane, y, word);
            for (int k = 0; k < 2; k++) cover.of[k] = i_xor3(cover.of[k], a.of[k], b.of[k]);
        }
        i_store(mask, i_or(i_load(mask), cover.of[0]));
        i_store(mask + SS_BLOCK, i_or(i_load(mask + SS_BLOCK), cover.of[1]));
    }
}

/* One triangle in these lanes. */
static inline void draw_triangle(walk *w, const place v[3], uint32_t lanes, int clipped) {
    polygon p; /* 1,600 bytes that need no clearing */
    p.count = 0;
    p.box = (bounds){f_set(1e30f), f_set(-1e30f), f_set(1e30f), f_set(-1e30f)};
    if (clipped) {
        clip_triangle(w, &p, v, lanes);
    } else {
        const pixel q[3] = {project(&v[0]), project(&v[1]), project(&v[2])};
        for (int c = 0; c < 3; c++)
            add_edge(w, &p, &v[c], &v[(c + 1) % 3], &q[c], &q[(c + 1) % 3], lanes);
    }
    lanes &= m_bits(touched(w, &p.box, 0));
    for (uint32_t r = 0; r < w->row_blocks && lanes; r++) {
        const uint32_t here = lanes & in_row_block(&p.box, r);
        uint32_t word = 0;
        for (; word + 1 < w->words && here; word += 2) {
            const uint32_t left = here & in_word(&p.box, word),
                           right = here & in_word(&p.box, word + 1), at = r * w->words + word;
            draw_pair(w, &p, at, left & right);
            draw_block(w, &p, at, left & ~right);
            draw_block(w, &p, at + 1, right & ~left);
        }
        if (word < w->words && here) {
            draw_block(w, &p, r * w->words + word,
                       w->words > 1 ? here & in_word(&p.box, word) : here);
        }
    }
    w->work += 3;
}

/* ---- outlines ----------------------------------------------------------------------------------
 *
 * A sample's winding number is how many edges to its left run up less how many run down. Both are
 * counted in bit-planes, each plane a mask, by carry-save addition: any depth is exact, because
 * there are planes for more edges than a list holds. */

#define PLANES SS_GROUP_PLANES

static inline uint32_t *plane_at(const walk *w, unsigned lane, uint32_t block, int down,
                                 unsigned plane) {
    return w->g->planes +
           ((((size_t)lane * w->blocks + block) * 2 + (size_t)down) * PLANES + plane) * SS_BLOCK;
}

static inline void carry_up(walk *w, unsigned lane, uint32_t block, int down, vi carry) {
    for (unsigned plane = 3; plane < PLANES && i_any(carry); plane++) {
        uint32_t *at = plane_at(w, lane, block, down, plane);
        const vi old = i_load(at);
        i_store(at, i_xor(old, carry));
        carry = i_and(old, carry);
        if (plane >= w->planes) w->planes = plane + 1;
    }
}

/* The lowest three planes of a block, while edges are added to them. */
typedef struct counter {
    vi ones, twos, fours;
    uint32_t *at;
} counter;

static inline counter open_counter(const walk *w, unsigned lane, uint32_t block, int down) {
    uint32_t *at = plane_at(w, lane, block, down, 0);
    return (counter){i_load(at), i_load(at + SS_BLOCK), i_load(at + 2 * SS_BLOCK), at};
}

static inline void close_counter(const counter *c) {
    i_store(c->at, c->ones);
    i_store(c->at + SS_BLOCK, c->twos);
    i_store(c->at + 2 * SS_BLOCK, c->fours);
}

/* Two edges; what is carried out of the three planes. */
static inline vi add_two(counter *c, vi first, vi second) {
    const vi carry = i_majority(c->ones, first, second);
    c->ones = i_xor3(c->ones, first, second);
    const vi more = i_and(c->twos, carry);
    c->twos = i_xor(c->twos, carry);
    const vi most = i_and(c->fours, more);
    c->fours = i_xor(c->fours, more);
    return most;
}

static inline void count_edges(walk *w, unsigned lane, uint32_t block, int down, uint64_t list) {
    const vf y = f_load(w->row + SS_BLOCK * (block / w->words));
    const uint32_t word = block % w->words;
    counter c = open_counter(w, lane, block, down);
    while (list) {
        const vi first = edge_block(&w->batch.edges[__builtin_ctzll(list)], lane, y, word);
        vi second = i_zero();
        list &= list - 1;
        if (list) {
            second = edge_block(&w->batch.edges[__builtin_ctzll(list)], lane, y, word);
            list &= list - 1;
        }
        const vi most = add_two(&c, first, second);
        if (i_any(most)) carry_up(w, lane, block, down, most);
    }
    close_counter(&c);
}

/* In this block and the next, which is to its right. */
static inline void count_pairs(walk *w, unsigned lane, uint32_t block, int down, uint64_t list) {
    const vf y = f_load(w->row + SS_BLOCK * (block / w->words));
    const uint32_t word = block % w->words;
    counter left = open_counter(w, lane, block, down),
            right = open_counter(w, lane, block + 1, down);
    while (list) {
        const pair first = edge_pair(&w->batch.edges[__builtin_ctzll(list)], lane, y, word);
        pair second = {{i_zero(), i_zero()}};
        list &= list - 1;
        if (list) {
            second = edge_pair(&w->batch.edges[__builtin_ctzll(list)], lane, y, word);
            list &= list - 1;
        }
        const vi a = add_two(&left, first.of[0], second.of[0]),
                 b = add_two(&right, first.of[1], second.of[1]);
        if (!i_any(i_or(a, b))) continue;
        carry_up(w, lane, block, down, a);
        carry_up(w, lane, block + 1, down, b);
    }
    close_counter(&left);
    close_counter(&right);
}

/* All edges of one direction that cross a row block. */
static inline void count_row(walk *w, unsigned lane, uint32_t row_block, int down, uint64_t list) {
    uint32_t word = 0;
    if (!list) return;
    for (; word + 1 < w->words; word += 2)
        count_pairs(w, lane, row_block * w->words + word, down, list);
    if (word < w->words) count_edges(w, lane, row_block * w->words + word, down, list);
}

/* Counts the edges of the batch and empties it. */
static inline void draw_batch(walk *w) {
    batch *b = &w->batch;
    if (!b->count) return;
    const uint64_t all = b->count == 64 ? UINT64_MAX : (UINT64_C(1) << b->count) - 1;
    for (uint32_t lanes = w->open; lanes; lanes &= lanes - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(lanes);
        const uint64_t up = lane_bits(b->positive, lane) & all;
        for (uint32_t r = 0; r < w->row_blocks; r++) {
            const uint64_t here = lane_bits(b->touched[r], lane) & all;
            count_row(w, lane, r, 0, here & up);
            count_row(w, lane, r, 1, here & ~up);
        }
    }
    b->count = 0;
}

/* Covers what winds and clears the planes for the next list. */
static inline void settle_windings(walk *w) {
    for (uint32_t lanes = w->open; lanes; lanes &= lanes - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(lanes);
        uint32_t *mask = ss_group_mask(w->g, lane);
        for (uint32_t b = 0; b < w->blocks; b++) {
            vi cover = i_load(mask + SS_BLOCK * b);
            for (unsigned p = 0; p < w->planes; p++) {
                uint32_t *up = plane_at(w, lane, b, 0, p), *down = plane_at(w, lane, b, 1, p);
                cover = i_or(cover, i_xor(i_load(up), i_load(down)));
                i_store(up, i_zero());
                i_store(down, i_zero());
            }
            i_store(mask + SS_BLOCK * b, cover);
        }
    }
    w->planes = 3;
}

/* sum: how often the edge counts from its first end to its second, or the other way. */
static inline void push_edge(walk *w, const float ends[8], int32_t sum) {
    const place from = transform(w->g, ends), to = transform(w->g, ends + 4);
    const pixel a = project(&from), c = project(&to);
    const bounds around = {f_min(a.x, c.x), f_max(a.x, c.x), f_min(a.y, c.y), f_max(a.y, c.y)};
    if (w->g->marks) {
        edge e;
        bounds box;
        set_edge(&e, &box, &from, &to, &a, &c, w->rows / 2);
        mark_edge(w, &e, &box, f_max(from.t, to.t), w->open);
    }
    const uint32_t lanes = m_bits(touched(w, &around, 1)) & w->open;
    if (!lanes) return;
    for (int32_t left = sum > 0 ? sum : -sum; left > 0; left--) {
        batch *b = &w->batch;
        bounds box;
        const vm up = set_edge(&b->edges[b->count], &box, &from, &to, &a, &c, w->rows / 2);
        for (uint32_t r = 0; r < w->row_blocks; r++) {
            b->touched[r][b->count] = (uint16_t)(in_row_block(&around, r) & lanes);
        }
        b->positive[b->count] = (uint16_t)(sum > 0 ? m_bits(up) : ~m_bits(up));
        if (++b->count == BATCH) draw_batch(w);
    }
}

/* Draws the outline of one side's faces: the edges of the list whose sum is not zero. */
static inline void draw_list(walk *w, uint32_t side) {
    const ss_group *g = w->g;
    bool any = false;
    for (uint32_t i = 0; i < g->list_count; i++) {
        const uint32_t ahead = i + 8 < g->list_count ? i + 8 : i;
        __builtin_prefetch(g->slab->outline->ends[g->keys[g->list[ahead]] >> 1]);
        const uint32_t key = g->keys[g->list[i]];
        const int32_t sum = g->sums[g->list[i]];
        if ((key & 1) != side || sum == 0) continue;
        push_edge(w, g->slab->outline->ends[key >> 1], sum);
        any = true;
    }
    if (!any) return;
    draw_batch(w);
    settle_windings(w);
}

/* Closes lanes that see nothing of the light any more. */
static inline void close_lanes(walk *w) {
    w->work = 0;
    for (uint32_t m = w->open; m; m &= m - 1) {
        const unsigned lane = (unsigned)__builtin_ctz(m);
        const uint32_t *mask = ss_group_mask(w->g, lane);
        int full = 1;
        for (uint32_t b = 0; b < w->blocks && full; b++)
            full = i_all_ones(i_load(mask + SS_BLOCK * b));
        if (full) w->open &= ~(1u << lane);
    }
}

static inline void flush(walk *w) {
    ss_group *g = w->g;
    for (uint32_t side = 0; side < 2 && g->list_count && w->open; side++) draw_list(w, side);
    for (uint32_t i = 0; i < g->list_count; i++) g->keys[g->list[i]] = SS_NO_KEY;
    g->list_count = w->uses = 0;
    close_lanes(w);
}

/* Adds uses of edges by faces of one side; where two faces of that side share an edge, it goes.
 * Whether an edge is listed already cannot be foretold, so nothing branches on it. */
static inline void add_uses(ss_group *g, const uint32_t *uses, uint32_t n, uint32_t side) {
    uint32_t *const keys = g->keys;
    int16_t *const sums = g->sums;
    uint16_t *const list = g->list;
    uint32_t count = g->list_count;
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t key = (uses[i] & ~1u) | side;
        uint32_t at = key * 0x9E3779B1u >> (32 - SS_GROUP_SLOT_BITS), found = keys[at];
        while (__builtin_expect(found != key && found != SS_NO_KEY, 0)) {
            at = (at + 1) % SS_GROUP_SLOTS;
            found = keys[at];
        }
        const bool fresh = found != key;
        keys[at] = key;
        sums[at] = (int16_t)((fresh ? 0 : sums[at]) + 1 - (int)(uses[i] & 1) * 2);
        list[count] = (uint16_t)at;
        count += fresh;
    }
    g->list_count = count;
}

/* Room for that many more uses, drawing what is listed if there is not. */
static inline void reserve(walk *w, uint32_t uses) {
    if (w->g->list_count + uses > SS_GROUP_LIST || w->uses + uses > SS_GROUP_USES) flush(w);
    w->uses += uses;
}

#endif
