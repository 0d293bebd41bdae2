# SPDX-License-Identifier: Apache-2.0
"""Blender's lights as the library's: full extents become half axes, a sun's angle its half.

As Cycles has them: a point or spot light is a ball of its radius, whatever its object's scale; an
area light is scaled with its object and emits along -Z.
"""
import numpy


def shape_of(package, light, matrix):
    """The library's light for a bpy.types.Light placed by a 4x4 matrix."""
    place, axes = matrix[:3, 3], matrix[:3, :3]
    if light.type == "SUN":
        return package.Sun(-axes[:, 2], light.angle / 2)
    if light.type != "AREA":
        return package.Sphere(place, light.shadow_soft_size)
    long = light.size
    wide = light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size
    u, v = axes[:, 0] * long / 2, axes[:, 1] * wide / 2
    if numpy.dot(numpy.cross(u, v), axes[:, 2]) > 0:
        v = -v  # u x v is the side that emits
    if light.shape in ("SQUARE", "RECTANGLE"):
        return package.Rect(place, u, v)
    return package.Ellipse(place, u, v)  # a disk, too, once its object is scaled


def radiance(light, matrix, points, normals):
    """What a white diffuse surface at the points would send back from the unshadowed light, in
    the units of Cycles, taking the light for a point in its middle: float64 of shape (N, 3)."""
    colour = numpy.array(light.color) * light.energy / numpy.pi
    towards = matrix[:3, 2] / numpy.linalg.norm(matrix[:3, 2])
    if light.type == "SUN":
        return numpy.outer(numpy.clip(normals @ towards, 0, None), colour)
    way = matrix[:3, 3] - points
    square = numpy.maximum(numpy.einsum("ij,ij->i", way, way), 1e-12)
    way /= numpy.sqrt(square)[:, None]
    power = numpy.clip(numpy.einsum("ij,ij->i", way, normals), 0, None) / square
    leaving = way @ towards
    if light.type == "AREA":
        power *= numpy.clip(leaving, 0, None) / 4
    else:
        power /= 4 * numpy.pi
        if light.type == "SPOT":
            power *= _cone(light, leaving) * leaving  # the cosine as Cycles 3.4 has it
    return numpy.outer(power, colour)


def _cone(light, cosine):
    """1 inside a spot's cone, 0 outside, smooth over the part that is blended."""
    edge = numpy.cos(light.spot_size / 2)
    soft = max((1 - edge) * light.spot_blend, 1e-6)
    step = numpy.clip((cosine - edge) / soft, 0, 1)
    return step * step * (3 - 2 * step)
