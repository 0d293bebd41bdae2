# SPDX-License-Identifier: Apache-2.0
"""Answers as Blender's data: colour attributes and images."""
import bpy
import numpy


def write_attribute(mesh, name, domain, values):
    """A float colour attribute of grey values; one of that name and kind is overwritten."""
    layer = mesh.color_attributes.get(name)
    if layer and (layer.domain != domain or layer.data_type != "FLOAT_COLOR"):
        mesh.color_attributes.remove(layer)
        layer = None
    if not layer:
        layer = mesh.color_attributes.new(name, "FLOAT_COLOR", domain)
    layer.data.foreach_set("color", grey(values).ravel())
    mesh.color_attributes.active_color = layer
    mesh.update()
    return layer.name


def grey(values):
    """RGBA, opaque."""
    out = numpy.ones((len(values), 4), numpy.float32)
    out[:, :3] = numpy.asarray(values)[:, None]
    return out


def write_image(name, pixels):
    """A float image (height, width, 4), packed, so that it is saved with the file. In the place of
    an image of that name comes a new one, which is what undo can take back: it keeps no pixels."""
    old = bpy.data.images.get(name)
    image = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], alpha=True,
                                float_buffer=True)
    image.pixels.foreach_set(numpy.ascontiguousarray(pixels, numpy.float32).ravel())
    image.update()
    image.pack()
    if old:
        old.user_remap(image)
        bpy.data.images.remove(old)
        image.name = name
    return image


def show_image(context, image):
    """In the first image editor of the window, if there is one."""
    for area in context.screen.areas if context.screen else ():
        if area.type == "IMAGE_EDITOR":
            area.spaces.active.image = image
            return
