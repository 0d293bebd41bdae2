# SPDX-License-Identifier: Apache-2.0
"""Which triangle lies at the middle of each cell of a grid: texels of an image by UV, pixels of a
camera.

based on: Olano and Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates (1997): with
corners (x, y, w) the numbers q = M^-1 (X, Y, 1) are the corners' shares over the depth w, so nothing is
clipped but rows, and shares come out right in perspective.
"""
import numpy

ROWS = 1 << 16   # of triangles, worked on at once
CELLS = 1 << 20  # likewise


class Grid:
    """What the cells of a width x height grid show; row 0 is at the bottom, as in Blender's images."""

    def __init__(self, width, height):
        self.width, self.height = width, height
        self.item = numpy.full(width * height, -1, numpy.int32)  # -1: nothing
        self.shares = numpy.zeros((width * height, 3), numpy.float32)
        self.depth = numpy.full(width * height, numpy.inf, numpy.float32)

    def add(self, corners, first, stop=lambda: None):
        """Adds triangles: corners (T, 3, 4) in clip space, of which -w..w is seen; their items are
        first, first + 1, ... The nearest wins, among equals the first. stop() is called now and then
        and may raise."""
        screen = corners[:, :, [0, 1, 3]].astype(numpy.float64)
        screen[:, :, 0] = (screen[:, :, 0] + screen[:, :, 2]) * self.width / 2
        screen[:, :, 1] = (screen[:, :, 1] + screen[:, :, 2]) * self.height / 2
        low, high = _rows(screen, corners[:, :, 2] + corners[:, :, 3], self.height)
        count = numpy.where(numpy.abs(numpy.linalg.det(screen)) > 0, high - low, 0)
        for some in batches(count, ROWS):
            stop()
            some = some[count[some] > 0]
            if len(some):
                self._add_rows(screen[some], corners[some, :, 2], first + some, low[some],
                               count[some], stop)

    def _add_rows(self, screen, z, items, low, count, stop):
        inverse = numpy.linalg.inv(numpy.swapaxes(screen, 1, 2))  # q = inverse (X, Y, 1)
        which = numpy.repeat(numpy.arange(len(items)), count)
        row = _steps(count) + low[which]
        slope = inverse[which, :, 0]
        rest = inverse[which, :, 1] * (row + 0.5)[:, None] + inverse[which, :, 2]
        begin, cells = _spans(slope, rest, self.width)
        for some in batches(cells, CELLS):
            stop()
            line = numpy.repeat(some, cells[some])
            column = _steps(cells[some]) + begin[line]
            q = slope[line] * (column + 0.5)[:, None] + rest[line]
            numpy.clip(q, 0, None, out=q)  # a cell on an edge may be outside by rounding
            depth = numpy.einsum("ij,ij->i", q, z[which[line]])
            seen = (numpy.abs(depth) <= 1) & (q.sum(1) > 0)
            cell = row[line] * self.width + column
            self._nearest(cell[seen], depth[seen], items[which[line[seen]]], q[seen])

    def _nearest(self, cell, depth, items, q):
        depth = depth.astype(numpy.float32)
        order = numpy.lexsort((items, depth, cell))
        order = order[numpy.concatenate(([True], numpy.diff(cell[order]) > 0))[:len(order)]]
        order = order[depth[order] < self.depth[cell[order]]]
        cell = cell[order]
        self.depth[cell] = depth[order]
        self.item[cell] = items[order]
        self.shares[cell] = q[order] / q[order].sum(1)[:, None]


def _rows(screen, front, height):
    """The rows that each triangle's part before the camera may touch."""
    low, high = numpy.full(len(screen), numpy.inf), numpy.full(len(screen), -numpy.inf)
    for i in range(3):
        j = (i + 1) % 3
        near, cut = front[:, i] > 0, (front[:, i] > 0) != (front[:, j] > 0)
        with numpy.errstate(divide="ignore", invalid="ignore"):
            t = (front[:, i] / (front[:, i] - front[:, j]))[:, None]
            crossing = screen[:, i] + t * (screen[:, j] - screen[:, i])
            for place, some in ((screen[:, i], near), (crossing, cut)):
                y = place[:, 1] / place[:, 2]
                low = numpy.where(some, numpy.fmin(low, y), low)
                high = numpy.where(some, numpy.fmax(high, y), high)
    low = numpy.clip(numpy.ceil(low - 0.5), 0, height)
    high = numpy.clip(numpy.floor(high - 0.5) + 1, 0, height)
    return low.astype(numpy.int64), numpy.maximum(high, low).astype(numpy.int64)


def _spans(slope, rest, width):
    """In each row the first cell with all q >= 0, and how many there are."""
    low, high = numpy.zeros(len(slope)), numpy.full(len(slope), float(width))
    with numpy.errstate(divide="ignore", invalid="ignore"):
        zero = -rest / slope
    for i in range(3):
        low = numpy.where(slope[:, i] > 0, numpy.maximum(low, numpy.ceil(zero[:, i] - 0.5)), low)
        high = numpy.where(slope[:, i] < 0,
                           numpy.minimum(high, numpy.floor(zero[:, i] - 0.5) + 1), high)
        high = numpy.where((slope[:, i] == 0) & (rest[:, i] < 0), 0, high)
    begin = numpy.clip(low, 0, width).astype(numpy.int64)
    return begin, numpy.maximum(numpy.clip(high, 0, width).astype(numpy.int64) - begin, 0)


def batches(counts, most):
    """Index arrays of neighbours whose counts sum to most or a little more."""
    if not len(counts):
        return
    part = numpy.cumsum(counts) // most
    yield from numpy.split(numpy.arange(len(counts)), numpy.flatnonzero(numpy.diff(part)) + 1)


def _steps(counts):
    """0, 1, ... counts[0] - 1, 0, 1, ... counts[1] - 1, ..."""
    start = numpy.cumsum(counts) - counts
    return numpy.arange(counts.sum()) - numpy.repeat(start, counts)


def grow(pixels, known, steps):
    """Lets known cells of (height, width) pixels spread into their neighbours, one ring a step."""
    pixels, known = numpy.pad(pixels, 1), numpy.pad(known, 1)
    for _ in range(steps):
        total, count = numpy.zeros_like(pixels), numpy.zeros(pixels.shape, numpy.int8)
        for y in (-1, 0, 1):
            for x in (-1, 0, 1):
                if x or y:
                    # the border is never known, so that what is rolled around adds nothing
                    beside = numpy.roll(known, (y, x), (0, 1))
                    total += numpy.where(beside, numpy.roll(pixels, (y, x), (0, 1)), 0)
                    count += beside
        ring = (count > 0) & ~known
        ring[[0, -1]] = ring[:, [0, -1]] = False
        pixels[ring] = total[ring] / count[ring]
        known = known | ring
    return pixels[1:-1, 1:-1], known[1:-1, 1:-1]
