# SPDX-License-Identifier: Apache-2.0
"""Where to ask: the vertices or corners of a mesh, the texels of its UV map, a camera's pixels."""
import numpy

from . import cover

MANY = 1 << 17  # triangles that go to the grid at once


class Places:
    """Points with what the library wants to know about them."""

    def __init__(self, points, normals, primitives):
        self.points, self.normals, self.primitives = points, normals, primitives


def of_elements(questions, placed, domain, count):
    """The first count vertices, or corners, of a mesh."""
    shape = placed.shape
    flat = shape.loops if domain == "CORNER" else shape.triangles
    last = len(flat) - 1
    triangle = numpy.full(max(count, flat.max() + 1), -1, numpy.int64)
    # backwards, so that the first triangle around a vertex is the one that stays
    triangle[flat[::-1].ravel()] = last - numpy.arange(flat.size) // 3
    if domain == "CORNER":
        positions, normals = shape.positions[shape.vertex_of], shape.corners
    else:
        positions, normals = shape.positions, shape.vertex_normals()
    return Places(placed.world(positions[:count].astype(numpy.float64)),
                  placed.normals(normals[:count]),
                  questions.primitives(placed, triangle[:count]))


def of_texels(questions, placed, size, job):
    """(the cells that a UV map's unit square covers, their places)."""
    shape, grid = placed.shape, cover.Grid(size, size)
    corners = numpy.ones((len(shape.loops), 3, 4), numpy.float32)
    corners[:, :, :2] = shape.uvs[shape.loops] * 2 - 1
    corners[:, :, 2] = 0
    grid.add(corners, 0, job.check)
    view = View(grid, [placed])
    return view.cells, view.places(questions)


def of_pixels(world, clip, width, height, job):
    """What a camera sees; clip takes a point of the world to -w..w."""
    grid, shown = cover.Grid(width, height), [p for p in world.placed if p.seen]
    counts = numpy.array([len(p.shape.triangles) for p in shown], int)
    first = numpy.cumsum(counts) - counts
    for group in cover.batches(counts, MANY):
        corners = [_clip(shown[n], clip) for n in group]
        grid.add(numpy.concatenate(corners), first[group[0]], job.check)
    return View(grid, shown)


def _clip(placed, clip):
    return (_world(placed) @ clip[:, :3].T + clip[:, 3])[placed.shape.triangles]


def _world(placed):
    return placed.world(placed.shape.positions.astype(numpy.float64))


class View:
    """The surfaces that a grid shows."""

    def __init__(self, grid, shown):
        self.cells = numpy.flatnonzero(grid.item >= 0)
        self.shown, self.shares = shown, grid.shares[self.cells].astype(numpy.float64)
        counts = numpy.array([len(p.shape.triangles) for p in shown], int)
        begin = numpy.cumsum(counts) - counts
        items = grid.item[self.cells]
        self.owner = numpy.searchsorted(begin + counts, items, side="right")
        self.triangle = items - begin[self.owner]

    def parts(self):
        """(placed, which of the cells show it) for all that are seen."""
        order = numpy.argsort(self.owner, kind="stable")
        edges = numpy.flatnonzero(numpy.diff(self.owner[order])) + 1
        for some in numpy.split(order, edges) if len(order) else ():
            yield self.shown[self.owner[some[0]]], some

    def places(self, questions, eye=None):
        """Of all cells, in their order. With an eye (x, y, z, 1) or, far away, (x, y, z, 0) normals
        are those of the sides that it sees."""
        points = numpy.empty((len(self.cells), 3))
        normals = numpy.empty((len(self.cells), 3), numpy.float32)
        primitives = numpy.empty(len(self.cells), numpy.uint64)
        for placed, some in self.parts():
            shape, triangle, shares = placed.shape, self.triangle[some], self.shares[some]
            corner = _world(placed)[shape.triangles[triangle]]
            points[some] = numpy.einsum("ij,ijk->ik", shares, corner)
            normal = placed.normals(numpy.einsum(
                "ij,ijk->ik", shares, shape.corners[shape.loops[triangle]]))
            if eye is not None:
                # the face decides: near an outline an interpolated normal may turn away too early
                side = _side(corner, eye) * placed.hand
                normal *= numpy.where(side < 0, -1, 1)[:, None].astype(numpy.float32)
            normals[some] = normal
            primitives[some] = questions.primitives(placed, triangle)
        return Places(points, normals, primitives)

    def colours(self):
        """Of the materials, (cells, 3)."""
        out = numpy.empty((len(self.cells), 3))
        for placed, some in self.parts():
            slot = placed.shape.materials[self.triangle[some]]
            out[some] = numpy.array(placed.colours)[numpy.minimum(slot, len(placed.colours) - 1)]
        return out


def _side(corner, eye):
    """> 0 where the eye sees the triangle's corners counter-clockwise."""
    face = numpy.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return numpy.einsum("ij,ij->i", face, eye[:3] - eye[3] * corner[:, 0])
