# SPDX-License-Identifier: Apache-2.0
"""A picture from the scene's camera: diffuse surfaces, unshadowed light times visibility."""
import numpy

from . import lights, places


class Camera:
    """The scene's camera, for pictures of some size."""

    def __init__(self, context, settings):
        scene, obj = context.scene, context.scene.camera
        if not obj or obj.type != "CAMERA":
            raise ValueError("the scene has no camera")
        if obj.data.type == "PANO":
            raise ValueError("%s: a panoramic camera; perspective and orthographic ones are "
                             "supported" % obj.name)
        render = scene.render
        part = settings.percentage / 100
        self.width = max(1, int(render.resolution_x * part))
        self.height = max(1, int(render.resolution_y * part))
        graph = context.evaluated_depsgraph_get()
        obj = obj.evaluated_get(graph)
        projection = obj.calc_matrix_camera(
            graph, x=self.width, y=self.height, scale_x=render.pixel_aspect_x,
            scale_y=render.pixel_aspect_y)
        matrix = obj.matrix_world.normalized()
        self.clip = numpy.array(projection @ matrix.inverted(), numpy.float64)
        self.eye = numpy.array(matrix, numpy.float64)[:, 2 if obj.data.type == "ORTHO" else 3]


def draw(questions, world, camera, settings, job):
    """RGBA pixels (height, width, 4), linear; transparent where nothing is seen."""
    times = settings["oversampling"]
    width, height = camera.width * times, camera.height * times
    view = places.of_pixels(world, camera.clip, width, height, job)
    here = view.places(questions, camera.eye)
    seen = questions.ask(here.points, here.normals, here.primitives)
    if settings["content"] == "VISIBILITY":
        colour = numpy.repeat(seen.mean(0)[:, None], 3, 1)
    else:
        colour = numpy.tile(numpy.array(world.background, float), (len(here.points), 1))
        for lamp, fraction in zip(questions.lamps, seen):
            light = lights.radiance(lamp, lamp.matrix, here.points, here.normals)
            colour += light * (fraction if lamp.casts else numpy.ones_like(fraction))[:, None]
        colour *= view.colours()
    pixels = numpy.zeros((height * width, 4), numpy.float32)
    pixels[view.cells, :3] = colour
    pixels[view.cells, 3] = 1
    shape = camera.height, times, camera.width, times, 4
    pixels = pixels.reshape(shape).mean((1, 3))
    # what a half covered pixel has is the mean of the cells that are covered
    return numpy.concatenate((numpy.divide(pixels[:, :, :3], pixels[:, :, 3:], where=pixels[:, :, 3:] > 0,
                                           out=pixels[:, :, :3].copy()), pixels[:, :, 3:]), 2)
