"""Scenes with known answers, for the cases that run inside Blender: a lamp at z = 3, what hides it at
z = 1, the ground at z = 0."""
import math

import bpy
import numpy


def empty():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="softshadow_blender")
    return bpy.context.scene.softshadow


def mesh(name, corners, faces, collection=None):
    data = bpy.data.meshes.new(name)
    data.from_pydata(corners, [], faces)
    obj = bpy.data.objects.new(name, data)
    (collection or bpy.context.collection).objects.link(obj)
    return obj


def rectangle(name, x0, x1, y0, y1, z, collection=None):
    return mesh(name, [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)], [(0, 1, 2, 3)],
                collection)


def ground(count=21, half=2.0):
    """A grid of count x count vertices with a UV map over the unit square."""
    step = 2 * half / (count - 1)
    corners = [(-half + step * i, -half + step * j, 0) for j in range(count) for i in range(count)]
    faces = [(j * count + i, j * count + i + 1, (j + 1) * count + i + 1, (j + 1) * count + i)
             for j in range(count - 1) for i in range(count - 1)]
    obj = mesh("Ground", corners, faces)
    layer = obj.data.uv_layers.new(name="UVMap")
    for loop in obj.data.loops:
        x, y, _ = corners[loop.vertex_index]
        layer.data[loop.index].uv = (x + half) / (2 * half), (y + half) / (2 * half)
    return obj


def lamp(kind, place=(0, 0, 3), turn=(0, 0, 0), name="Lamp", scale=(1, 1, 1), **settings):
    data = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(data, key, value)
    obj = bpy.data.objects.new(name, data)
    obj.location, obj.rotation_euler, obj.scale = place, turn, scale
    bpy.context.collection.objects.link(obj)
    return obj


def select(*objects):
    bpy.context.view_layer.update()  # before, it does not know what is new
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def attribute(obj, name):
    """The red of a colour attribute; green, blue and alpha must agree."""
    layer = obj.data.color_attributes[name]
    values = numpy.empty((len(layer.data), 4), numpy.float32)
    layer.data.foreach_get("color", values.ravel())
    assert (values[:, :3] == values[:, :1]).all() and (values[:, 3] == 1).all()
    return values[:, 0]


def pixels(name):
    image = bpy.data.images[name]
    out = numpy.empty((image.size[1], image.size[0], 4), numpy.float32)
    image.pixels.foreach_get(out.ravel())
    return out


def vertices(obj):
    out = numpy.empty((len(obj.data.vertices), 3), numpy.float32)
    obj.data.vertices.foreach_get("co", out.ravel())
    return out.astype(float)


# ---- truths ----

def overlap(a0, a1, b0, b1):
    return numpy.clip(numpy.minimum(a1, b1) - numpy.maximum(a0, b0), 0, None)


def behind_rectangles(points, rectangles, wide, high):
    """A light of full extents wide and high at (0, 0, 3); rectangles (x0, x1, y0, y1) at z = 1 that
    do not overlap."""
    hidden = 0
    for x0, x1, y0, y1 in rectangles:
        hidden = hidden + (
            overlap(3 * x0 - 2 * points[:, 0], 3 * x1 - 2 * points[:, 0], -wide / 2, wide / 2) *
            overlap(3 * y0 - 2 * points[:, 1], 3 * y1 - 2 * points[:, 1], -high / 2, high / 2))
    return 1 - hidden / (wide * high)


def part_of_disk(t):
    """The part of a disk on one side of a line at the distance t from its middle, in radii."""
    t = numpy.clip(t, -1, 1)
    return 0.5 + (t * numpy.sqrt(1 - t * t) + numpy.arcsin(t)) / math.pi
