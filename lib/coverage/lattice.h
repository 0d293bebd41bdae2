/* The light as samples: one fixed set for every point, so that answers have no noise.
 *
 * The samples are the points of a square lattice that lie on the light's shape (the square [-1,1]^2
 * or the unit disk). The lattice is turned by the golden angle's slope, the direction that rational
 * slopes come least near to: an edge along an axis of the light crosses its rows as evenly as one
 * can. In GRID coordinates the lattice is the integers: sample (row r, column c) lies at (x, y) =
 * (c + 1, r + 1). An edge of a caster then covers, in each row, all columns from some number on: a
 * whole row is one shift, and no table of masks is needed.
 *
 * A MASK has one bit a place of the grid: blocks of sixteen rows by thirty-two columns, word i of a
 * block holding row i. Places that are no sample are always set ("covered").
 *
 * Samples near the rim stand for more or less than a cell of the lattice: each has the area of the
 * places nearest to it as its weight, in sixteenths of a cell, which takes away the noise that
 * counting lattice points in a disk has. */
#ifndef SS_COVERAGE_LATTICE_H
#define SS_COVERAGE_LATTICE_H

#include <stdbool.h>
#include <stdint.h>

#include "scene/light.h"
#include "softshadow.h"

#define SS_BLOCK         16 /* words, and rows, of a block */
#define SS_LATTICE_LEAST 256
#define SS_LATTICE_MOST  65536
#define SS_LATTICE_REACH                                                                           \
    2.5f /* cells: no part of the light is farther from the sample that has it */

typedef struct ss_lattice {
    uint32_t count;
    uint32_t row_blocks,
        words; /* the grid is 16 row_blocks x 32 words; block = row block * words + word */
    uint32_t blocks;
    double grid[2][3]; /* x, y = grid[.][0] s + grid[.][1] t + grid[.][2] */
    uint32_t *outside; /* a mask: the places that are no sample */
    uint32_t *weight;  /* blocks x 16 x 32: [word][bit], 0 outside */
    float *s, *t;      /* likewise: where on the light */
    uint32_t *plane;   /* planes x mask: bit p of the weights */
    uint32_t planes;
    uint64_t total;      /* sum of weights */
    uint32_t *rim;       /* a mask: samples that stand for more or less than their own cell */
    double weight_error; /* how far a sum of weights can be from the share of the light it stands
                            for */
} ss_lattice;

/* count is clipped to what is allowed. The profile, if the light has one, is part of the weights.
 */
softshadow_status ss_lattice_create(ss_lattice **out, const ss_light *light, uint32_t count);
void ss_lattice_destroy(ss_lattice *samples);
size_t ss_lattice_bytes(const ss_lattice *samples);

/* Sum of the weights of the samples that a mask does not cover. */
uint64_t ss_lattice_visible(const ss_lattice *samples, const uint32_t *covered);

#endif
