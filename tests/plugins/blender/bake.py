#!/usr/bin/env python3
"""Baking in Blender against closed forms: all kinds of light, modifiers, instances, images, undo."""
import math
import os
import runpy
import sys
import time
import unittest

import host

try:
    import bpy
except ImportError:
    host.check_host()
    sys.exit(host.run(__file__))

import numpy

import scenes

TOLERANCE = 1 / 256  # the RMS error that the add-on asks for in penumbra
MOST = 5 * TOLERANCE  # at a single point


class Case(unittest.TestCase):
    def setUp(self):
        self.settings = scenes.empty()
        self.ground = scenes.ground()
        self.points = scenes.vertices(self.ground)
        scenes.select(self.ground)

    def bake(self, name="Visibility Lamp"):
        self.assertEqual(bpy.ops.softshadow.bake_attribute(), {"FINISHED"})
        return scenes.attribute(self.ground, name)

    def assertNear(self, got, truth):
        """Close everywhere, and the case has shadow, penumbra and light."""
        error = numpy.abs(got - truth)
        self.assertLess(error.max(), MOST)
        self.assertLess(math.sqrt((error ** 2).mean()), TOLERANCE)
        self.assertTrue((truth == 1).any() and ((truth > 0.1) & (truth < 0.9)).any())

    def refuses(self, operator, *parts):
        with self.assertRaises(RuntimeError) as raised:
            operator()
        for part in parts:
            self.assertIn(part, str(raised.exception))


class Lights(Case):
    """Sizes are full extents in Blender."""

    def test_square(self):
        scenes.rectangle("Card", -.3, .5, -.4, .2, 1)
        scenes.lamp("AREA", shape="SQUARE", size=1.2, size_y=9)
        truth = scenes.behind_rectangles(self.points, [(-.3, .5, -.4, .2)], 1.2, 1.2)
        self.assertNear(self.bake(), truth)

    def test_rectangle_scaled_and_turned(self):
        scenes.rectangle("Card", -.3, .5, -.4, .2, 1)
        scenes.lamp("AREA", turn=(0, 0, math.pi / 2), scale=(2, .5, 3), shape="RECTANGLE", size=.8,
                    size_y=1.6)
        truth = scenes.behind_rectangles(self.points, [(-.3, .5, -.4, .2)], .8, 1.6)
        self.assertNear(self.bake(), truth)

    def test_disk(self):
        scenes.rectangle("Card", 0, 100, -100, 100, 1)
        scenes.lamp("AREA", shape="DISK", size=1.0)
        self.assertNear(self.bake(), scenes.part_of_disk(-2 * self.points[:, 0] / .5))

    def test_ellipse(self):
        """One card's edge across the long axis, one across the short."""
        card = scenes.rectangle("Card", 0, 100, -100, 100, 1)
        scenes.lamp("AREA", shape="ELLIPSE", size=2.0, size_y=.5)
        scenes.lamp("AREA", name="Scaled", shape="DISK", size=.5, scale=(1, 4, 1))
        self.assertNear(self.bake(), scenes.part_of_disk(-2 * self.points[:, 0] / 1.0))
        self.assertNear(scenes.attribute(self.ground, "Visibility Scaled"),
                        scenes.part_of_disk(-2 * self.points[:, 0] / .25))
        card.rotation_euler.z = math.pi / 2  # hides y > 0 now
        self.assertNear(self.bake(), scenes.part_of_disk(-2 * self.points[:, 1] / .25))
        self.assertNear(scenes.attribute(self.ground, "Visibility Scaled"),
                        scenes.part_of_disk(-2 * self.points[:, 1] / 1.0))

    def test_sun(self):
        scenes.rectangle("Card", 0, 100, -100, 100, 1)
        scenes.lamp("SUN", angle=1.0)
        self.assertNear(self.bake(), scenes.part_of_disk(-self.points[:, 0] / math.tan(.5)))

    def test_tilted_sun(self):
        """It shines along -Z: turned about Y it comes from +x, and shadows fall to -x."""
        scenes.rectangle("Card", -.3, .3, -.4, .4, 1)
        scenes.lamp("SUN", turn=(0, math.pi / 4, 0), angle=0)
        seen = self.bake()
        hidden = self.points[seen == 0]
        self.assertLess(numpy.abs(hidden.mean(0) - (-1, 0, 0)).max(), .05)
        self.assertTrue(set(numpy.unique(seen)) == {0, 1})

    def ball(self, kind):
        scenes.rectangle("Card", 0, 100, -100, 100, 1)
        # a scale of its object does not change a ball
        scenes.lamp(kind, scale=(3, 3, 3), shadow_soft_size=.4)
        centre = numpy.array((0, 0, 3))
        way = centre - self.points
        distance = numpy.linalg.norm(way, axis=1)
        radius = .4 * distance / numpy.sqrt(distance ** 2 - .4 ** 2)
        # the plane of the point and the card's edge, its normal towards the card
        normal = numpy.stack((numpy.ones(len(way)), numpy.zeros(len(way)), self.points[:, 0]), 1)
        normal /= numpy.linalg.norm(normal, axis=1)[:, None]
        sine = numpy.einsum("ij,ij->i", normal, way) / distance
        offset = distance * sine / numpy.sqrt(1 - sine ** 2)
        self.assertNear(self.bake(), scenes.part_of_disk(-offset / radius))

    def test_point(self):
        self.ball("POINT")

    def test_spot(self):
        self.ball("SPOT")

    def test_several(self):
        scenes.rectangle("Card", -.3, .5, -.4, .2, 1)
        square = scenes.lamp("AREA", name="Square", shape="SQUARE", size=1.2)
        scenes.lamp("AREA", name="Long", shape="RECTANGLE", size=2.4, size_y=.3)
        self.assertNear(self.bake("Visibility Square"), scenes.behind_rectangles(
            self.points, [(-.3, .5, -.4, .2)], 1.2, 1.2))
        self.assertNear(scenes.attribute(self.ground, "Visibility Long"), scenes.behind_rectangles(
            self.points, [(-.3, .5, -.4, .2)], 2.4, .3))
        self.ground.data.color_attributes.remove(
            self.ground.data.color_attributes["Visibility Long"])
        square.select_set(True)
        self.settings.lights = "SELECTED"
        self.bake("Visibility Square")
        self.assertEqual(len(self.ground.data.color_attributes), 1)

    def test_none(self):
        self.refuses(bpy.ops.softshadow.bake_attribute, "there is no light")
        scenes.lamp("SUN")
        self.settings.lights = "SELECTED"
        self.refuses(bpy.ops.softshadow.bake_attribute, "no light is selected")


class Surfaces(Case):
    """What casts is what the viewport shows."""

    PAIR = [(-.9, -.5, -.3, .3), (.5, .9, -.3, .3)]

    def setUp(self):
        super().setUp()
        scenes.lamp("AREA", shape="SQUARE", size=1.2)
        self.pair = scenes.behind_rectangles(self.points, self.PAIR, 1.2, 1.2)

    def test_modifier(self):
        card = scenes.rectangle("Card", -.9, -.5, -.3, .3, 1)
        array = card.modifiers.new("Array", "ARRAY")
        array.use_relative_offset, array.use_constant_offset = False, True
        array.constant_offset_displace = (1.4, 0, 0)
        self.assertNear(self.bake(), self.pair)

    def test_collection_instance(self):
        cards = bpy.data.collections.new("Cards")
        scenes.rectangle("Card", -.2, .2, -.3, .3, 0, cards)
        for x, mirror in (-.7, 1), (.7, -1):
            holder = bpy.data.objects.new("Holder", None)
            holder.instance_type, holder.instance_collection = "COLLECTION", cards
            holder.location, holder.scale = (x, 0, 1), (mirror, 1, 1)
            bpy.context.collection.objects.link(holder)
        self.assertNear(self.bake(), self.pair)

    def test_vertex_instances(self):
        parent = scenes.mesh("Parent", [(-.7, 0, 1), (.7, 0, 1)], [])
        child = scenes.rectangle("Card", -.2, .2, -.3, .3, 0)
        child.parent, parent.instance_type = parent, "VERTS"
        self.assertNear(self.bake(), self.pair)

    def test_geometry_nodes(self):
        tree = bpy.data.node_groups.new("Place", "GeometryNodeTree")
        if hasattr(tree, "interface"):  # 4.0
            tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        else:
            tree.outputs.new("NodeSocketGeometry", "Geometry")
        line = tree.nodes.new("GeometryNodeMeshLine")
        line.inputs["Count"].default_value = 2
        line.inputs["Start Location"].default_value = (-.7, 0, 1)
        line.inputs["Offset"].default_value = (1.4, 0, 0)
        card = tree.nodes.new("GeometryNodeMeshGrid")
        for name, value in ("Size X", .4), ("Size Y", .6), ("Vertices X", 2), ("Vertices Y", 2):
            card.inputs[name].default_value = value
        place = tree.nodes.new("GeometryNodeInstanceOnPoints")
        out = tree.nodes.new("NodeGroupOutput")
        tree.links.new(line.outputs["Mesh"], place.inputs["Points"])
        tree.links.new(card.outputs["Mesh"], place.inputs["Instance"])
        tree.links.new(place.outputs["Instances"], out.inputs[0])
        obj = scenes.mesh("Nodes", [], [])
        obj.modifiers.new("Nodes", "NODES").node_group = tree
        self.assertNear(self.bake(), self.pair)

    def test_curve_casts(self):
        scenes.rectangle("Card", -.9, -.5, -.3, .3, 1)
        curve = bpy.data.curves.new("Curve", "CURVE")
        curve.dimensions, curve.fill_mode = "2D", "BOTH"
        spline = curve.splines.new("POLY")
        spline.points.add(3)
        for point, (x, y) in zip(spline.points, ((.5, -.3), (.9, -.3), (.9, .3), (.5, .3))):
            point.co = x, y, 0, 1
        spline.use_cyclic_u = True
        obj = bpy.data.objects.new("Curve", curve)
        obj.location.z = 1
        bpy.context.collection.objects.link(obj)
        self.assertNear(self.bake(), self.pair)

    def test_what_casts_no_shadow(self):
        for x0, x1, y0, y1 in self.PAIR:
            scenes.rectangle("Card", x0, x1, y0, y1, 1)
        scenes.rectangle("Hidden", -2, 2, -2, 2, 1.5).hide_viewport = True
        scenes.rectangle("Shadowless", -2, 2, -2, 2, 1.6).visible_shadow = False
        self.assertNear(self.bake(), self.pair)

    def test_corners_of_a_box(self):
        """At a hard edge a vertex has one value, its corners have one for each face."""
        box = scenes.mesh("Box", [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 0)], [
            (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
        scenes.select(box)
        self.ground.hide_viewport = True
        self.settings.domain = "CORNER"
        bpy.ops.softshadow.bake_attribute()
        seen = scenes.attribute(box, "Visibility Lamp")
        top = numpy.repeat([p.normal.z for p in box.data.polygons], 4)
        self.assertEqual(seen[top > .5].tolist(), [1] * 4)
        self.assertEqual(seen[top < .5].tolist(), [0] * 20)

    def test_smooth_ball_has_no_acne(self):
        """Half of a ball faces a sun; nothing else hides it."""
        bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=1, location=(7, 3, 5))
        ball = bpy.context.object
        bpy.ops.object.shade_smooth()
        bpy.data.lights.remove(bpy.data.lights["Lamp"])
        scenes.lamp("SUN", angle=0, turn=(.5, .3, 0), name="Sun")
        for self.settings.domain in "POINT", "CORNER":
            scenes.select(ball)
            bpy.ops.softshadow.bake_attribute()
            seen = scenes.attribute(ball, "Visibility Sun")
            towards = numpy.array(bpy.data.objects["Sun"].matrix_world)[:3, 2]
            height = scenes.vertices(ball) @ towards
            if self.settings.domain == "CORNER":
                height = height[[loop.vertex_index for loop in ball.data.loops]]
            # the chords of 64 segments stay within 1 - cos(pi / 32) of the ball
            self.assertTrue((seen[height > .01] == 1).all())
            self.assertTrue((seen[height < -.01] == 0).all())

    def test_subdivided(self):
        """The first vertices of a subdivided mesh are its own, moved: asked where they went."""
        for x0, x1, y0, y1 in self.PAIR:
            scenes.rectangle("Card", x0, x1, y0, y1, 1)
        self.ground.data.vertices[0].co.z = -.2
        self.ground.modifiers.new("Subdivision", "SUBSURF").levels = 2
        graph = bpy.context.evaluated_depsgraph_get()
        evaluated = self.ground.evaluated_get(graph)
        points = scenes.vertices(evaluated)[:len(self.points)]
        inner = numpy.abs(points[:, 2]) < 1e-6
        self.assertTrue(inner.sum() > 400)
        truth = scenes.behind_rectangles(points, self.PAIR, 1.2, 1.2)
        self.assertNear(self.bake()[inner], truth[inner])

    def test_other_modifiers(self):
        self.ground.modifiers.new("Array", "ARRAY")
        self.refuses(bpy.ops.softshadow.bake_attribute, "Ground", "882 of 441 vertices", "apply")
        self.ground.modifiers.clear()
        self.ground.modifiers.new("Subdivision", "SUBSURF")
        self.settings.domain = "CORNER"
        self.refuses(bpy.ops.softshadow.bake_attribute, "Ground", "corners", "bake to an image")

    def test_baked_again(self):
        """The same attribute, and of the domain that is wanted."""
        for x0, x1, y0, y1 in self.PAIR:
            scenes.rectangle("Card", x0, x1, y0, y1, 1)
        self.bake()
        self.assertNear(self.bake(), self.pair)
        self.settings.domain = "CORNER"
        self.bake()
        self.assertEqual([(a.name, a.domain) for a in self.ground.data.color_attributes],
                         [("Visibility Lamp", "CORNER")])


class Images(Case):
    NAME = "Visibility Ground Lamp"
    CARD = [(-.3, .5, -.4, .2)]

    def setUp(self):
        super().setUp()
        scenes.rectangle("Card", *self.CARD[0], 1)
        scenes.lamp("AREA", shape="SQUARE", size=1.2)
        self.settings.image_size = 64

    def texels(self, size):
        """Where the middles of texels lie on the ground."""
        middles = 4 * (numpy.arange(size) + .5) / size - 2
        x, y = numpy.meshgrid(middles, middles)
        return numpy.stack((x.ravel(), y.ravel()), 1)

    def test_image(self):
        self.assertEqual(bpy.ops.softshadow.bake_image(), {"FINISHED"})
        got = scenes.pixels(self.NAME)
        self.assertEqual((got.shape, got[:, :, 3].min()), ((64, 64, 4), 1))
        self.assertNear(got[:, :, 0].ravel(), scenes.behind_rectangles(
            self.texels(64), self.CARD, 1.2, 1.2))
        image = bpy.data.images[self.NAME]
        self.assertTrue(image.is_float and image.packed_file)

    def test_modifier(self):
        """Images are of the mesh that is shown, however many faces it has."""
        self.ground.modifiers.new("Subdivision", "SUBSURF").subdivision_type = "SIMPLE"
        bpy.ops.softshadow.bake_image()
        self.assertNear(scenes.pixels(self.NAME)[:, :, 0].ravel(), scenes.behind_rectangles(
            self.texels(64), self.CARD, 1.2, 1.2))

    def test_margin(self):
        """An island of the left half goes on for the margin and no farther."""
        for item in self.ground.data.uv_layers[0].data:
            item.uv.x *= .5
        self.settings.margin = 3
        bpy.ops.softshadow.bake_image()
        got = scenes.pixels(self.NAME)
        self.assertEqual(got[:, :35, 3].min(), 1)
        self.assertEqual(got[:, 35:].max(), 0)
        self.assertLess(numpy.abs(got[1:-1, 34, 0] - got[1:-1, 31, 0]).max(), .05)

    def test_no_uv(self):
        self.ground.data.uv_layers.remove(self.ground.data.uv_layers[0])
        self.refuses(bpy.ops.softshadow.bake_image, "Ground", "no UV map")

    def test_saved_with_the_file(self):
        bpy.ops.softshadow.bake_image()
        before = scenes.pixels(self.NAME)
        bpy.data.images[self.NAME].use_fake_user = True
        path = bpy.app.tempdir + "saved.blend"
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        # packed as EXR of full floats
        self.assertEqual(numpy.abs(scenes.pixels(self.NAME) - before).max(), 0)


class Undo(Case):
    def setUp(self):
        super().setUp()
        scenes.rectangle("Card", -.3, .5, -.4, .2, 1)
        self.lamp = scenes.lamp("AREA", shape="SQUARE", size=1.2)
        bpy.ops.ed.undo_push(message="made")

    def attributes(self):
        return [a.name for a in bpy.data.objects["Ground"].data.color_attributes]

    def test_attribute(self):
        bpy.ops.softshadow.bake_attribute("EXEC_DEFAULT", True)  # as from a menu: undo is told
        self.assertEqual(self.attributes(), ["Visibility Lamp"])
        bpy.ops.ed.undo()
        self.assertEqual(self.attributes(), [])
        bpy.ops.ed.redo()
        self.assertEqual(self.attributes(), ["Visibility Lamp"])

    def test_image(self):
        """Undo brings back the pixels, too, which Blender does not keep by itself."""
        self.settings.image_size = 16
        bpy.ops.softshadow.bake_image("EXEC_DEFAULT", True)
        first = scenes.pixels(Images.NAME)
        self.lamp.location.x = 1
        bpy.ops.ed.undo_push(message="moved")
        bpy.ops.softshadow.bake_image("EXEC_DEFAULT", True)
        self.assertGreater(numpy.abs(scenes.pixels(Images.NAME) - first).max(), .1)
        bpy.ops.ed.undo()
        self.assertEqual(numpy.abs(scenes.pixels(Images.NAME) - first).max(), 0)


class Picture(unittest.TestCase):
    def test_picture(self):
        """The README's program, at a quarter of its size."""
        out = bpy.app.tempdir + "preview.png"
        scenes.empty()
        given, sys.argv = sys.argv, ["blender", "--", out, "25"]
        runpy.run_path(os.path.join(host.SOURCE, "plugins", "blender", "picture.py"))
        sys.argv = given
        image = bpy.data.images.load(out)
        self.assertEqual(image.size[:], (120, 77))
        grey = scenes.pixels(image.name)[:, :, :3].mean(2)
        self.assertTrue(grey.min() < .2 and grey.max() > .8)
        # many instances and materials: all of the picture shows something
        self.assertEqual(scenes.pixels("Soft Shadow Preview")[:, :, 3].min(), 1)


class Cancel(Case):
    def test_cancel(self):
        """A job that would take long stops soon and leaves nothing behind."""
        from softshadow_blender import ask, gather, places
        from softshadow_blender import softshadow
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6, radius=.8, location=(0, 0, 1))
        lamp = scenes.lamp("POINT", shadow_soft_size=.5)
        world = gather.World(bpy.context)
        settings = dict(method="raytrace", weighting="uniform", tolerance=1e-4)
        placed = world.find(self.ground)

        def work(job):
            questions = ask.Questions(softshadow, world, world.lamps, settings, job)
            with questions.scene:
                _, here = places.of_texels(questions, placed, 2048, job)
                return questions.ask(here.points, here.normals, here.primitives)
        job = ask.Job(work)
        job.start()
        while job.done < ask.BUILD + .001:
            self.assertTrue(job.running())
            time.sleep(.01)
        begin = time.time()
        job.cancel()
        while job.running():
            time.sleep(.01)
        # 4 million points of many rays each would take minutes
        self.assertLess(time.time() - begin, 10)
        self.assertTrue(job.cancelled() and job.result is None)
        self.assertEqual(lamp.name, "Lamp")


host.main()
