#!/usr/bin/env python3
"""Draws the ground under a ring and a ball as seen from above: ground.py PICTURE.png [SIZE]

Needs the package softshadow and nothing else; with numpy it would be shorter.
"""
import math
import struct
import sys
import zlib
from array import array

import softshadow


def surface(columns, rows, place):
    """A closed grid of quads: place(u, v) for u, v in 0..1 that wrap around."""
    points = [place(i / columns, j / rows) for j in range(rows) for i in range(columns)]
    triangles = []
    for j in range(rows):
        for i in range(columns):
            a, b = j * columns + i, j * columns + (i + 1) % columns
            c, d = (j + 1) % rows * columns + i, (j + 1) % rows * columns + (i + 1) % columns
            triangles += [(a, b, d), (a, d, c)]
    return points, triangles


def ring(u, v):
    u, v = 2 * math.pi * u, 2 * math.pi * v
    r = 1 + 0.2 * math.cos(v)
    return r * math.cos(u), 0.2 * math.sin(v), 1.3 + r * math.sin(u)


def ball(u, v):
    u, v = 2 * math.pi * u, math.pi * v
    r = 0.45 * math.sin(v)
    return r * math.cos(u), r * math.sin(u), 0.6 + 0.45 * math.cos(v)


def write_png(path, size, grey):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(
            ">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes(grey[i * size:(i + 1) * size]) for i in range(size))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" +
                   chunk(b"IHDR", struct.pack(">IIBBBBB", size, size, 8, 0, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def main(path, size=256):
    places = [4 * (i + 0.5) / size - 2 for i in range(size)]
    ground = array("f", [c for y in reversed(places) for x in places for c in (x - .4, y + 1, 0)])
    with softshadow.Scene() as scene:
        scene.add_mesh(*surface(96, 24, ring))
        scene.add_mesh(*surface(48, 24, ball))
        scene.set_light(softshadow.Rect((1.2, -3, 6), (0.4, 0, 0), (0, 0.4, 0.2)))
        scene.build()
        visibility = scene.visibility(ground)
        stats = scene.stats()
    write_png(path, size, [round(255 * v ** (1 / 2.2)) for v in visibility])
    print("%s: %d points, %d of them in penumbra" % (path, stats.points, stats.points_penumbra))


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:3]))
