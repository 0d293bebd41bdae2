/* Two 64-bit lanes that take a word each and then feed each other. Every step is a bijection of the
 * lanes for fixed words and of a word for fixed lanes: one changed word never goes unseen. */
#include "topology/hash.h"

#include <string.h>

static uint64_t turn(uint64_t x, int by) { return x << by | x >> (64 - by); }

static void take(ss_hash *h, uint64_t x, uint64_t y) {
    h->a = turn(h->a ^ x * 0x9e3779b97f4a7c15u, 31) * 0xbf58476d1ce4e5b9u + h->b;
    h->b = turn(h->b ^ y * 0xc2b2ae3d27d4eb4fu, 29) * 0x94d049bb133111ebu + h->a;
}

static uint64_t stir(uint64_t x) {
    x = (x ^ x >> 32) * 0xd6e8feb86659fd93u;
    x = (x ^ x >> 29) * 0xa0761d6478bd642fu;
    return x ^ x >> 32;
}

void ss_hash_add(ss_hash *h, const void *bytes, size_t count) {
    const unsigned char *at = bytes;
    uint64_t word[2];
    for (size_t left = count; left > 0;) {
        const size_t n = left < sizeof word ? left : sizeof word;
        if (n < sizeof word) memset(word, 0, sizeof word);
        memcpy(word, at, n);
        take(h, word[0], word[1]);
        at += n, left -= n;
    }
    take(h, count, ~(uint64_t)count);
    h->a += h->b, h->b += h->a;
    h->a = stir(h->a), h->b = stir(h->b);
    h->a += h->b, h->b += h->a;
}
