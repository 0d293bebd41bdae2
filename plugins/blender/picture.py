"""Draws the README's picture: blender -b --addons softshadow_blender --python picture.py -- OUT.png [PERCENT]"""
import math
import sys

import bpy

out, percent = (sys.argv[sys.argv.index("--") + 1:] + ["100"])[:2]


def material(name, colour):
    made = bpy.data.materials.new(name)
    made.diffuse_color = colour + (1,)
    bpy.context.object.data.materials.append(made)


def lamp(name, place, turn, colour, energy, **shape):
    data = bpy.data.lights.new(name, "AREA")
    data.color, data.energy = colour, energy
    for key, value in shape.items():
        setattr(data, key, value)
    obj = bpy.data.objects.new(name, data)
    obj.location, obj.rotation_euler = place, turn
    bpy.context.collection.objects.link(obj)


for obj in list(bpy.data.objects):
    bpy.data.objects.remove(obj)
bpy.ops.mesh.primitive_plane_add(size=40)
material("Floor", (.8, .78, .74))
bpy.ops.mesh.primitive_monkey_add(size=2, location=(0, 0, .99), rotation=(-.62, 0, .3))
bpy.ops.object.shade_smooth()
bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 2
material("Monkey", (.75, .5, .3))
bpy.ops.mesh.primitive_torus_add(location=(-2.3, .9, 1.0), rotation=(1.2, .3, .5), major_radius=.75,
                                 minor_radius=.16, major_segments=96, minor_segments=32)
bpy.ops.object.shade_smooth()
material("Ring", (.35, .5, .75))
bpy.ops.mesh.primitive_cylinder_add(vertices=64, radius=.05, depth=2.4, location=(1.7, .2, 1.2))
posts = bpy.context.object.modifiers.new("Array", "ARRAY")
posts.use_relative_offset, posts.use_constant_offset, posts.count = False, True, 5
posts.constant_offset_displace = (.28, .3, 0)
material("Posts", (.6, .65, .5))
lamp("Window", (5.2, 1.6, 4.4), (math.radians(51), 0, math.radians(107)), (1, .85, .65), 330,
     shape="RECTANGLE", size=.5, size_y=2.2)
lamp("Dish", (-3.4, -4.6, 5.6), (math.radians(45), 0, math.radians(-37)), (.6, .75, 1), 300, shape="DISK",
     size=.9)
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location, camera.rotation_euler = (-.1, -8, 5.2), (math.radians(59.5), 0, 0)
bpy.context.collection.objects.link(camera)
scene = bpy.context.scene
scene.camera = camera
scene.world = scene.world or bpy.data.worlds.new("World")
scene.world.color = .03, .03, .035
scene.render.resolution_x, scene.render.resolution_y = 480, 308
scene.render.image_settings.color_mode = "RGB"
scene.view_settings.view_transform = "Standard"
scene.softshadow.percentage, scene.softshadow.oversampling = int(percent), 3
scene.softshadow.weighting = "IRRADIANCE"
bpy.ops.softshadow.preview()
bpy.data.images["Soft Shadow Preview"].save_render(out)
