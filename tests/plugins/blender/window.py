#!/usr/bin/env python3
"""Blender with a window, on a virtual screen: the panel, progress, Esc and Ctrl-Z as a user gives them."""
import os
import subprocess
import sys
import time

import host

try:
    import bpy
except ImportError:
    host.check_host("Xvfb")
    sys.exit(host.run_in_window(__file__))

import scenes

found = []  # what went wrong


def check(truth, what):
    print("%s: %s" % ("ok" if truth else "FAILED", what), flush=True)
    if not truth:
        found.append(what)


def key(name, **more):
    window = bpy.context.window_manager.windows[0]
    place = dict(x=window.width // 2, y=window.height // 2)  # over the 3D view
    window.event_simulate(type="MOUSEMOVE", value="NOTHING", **place)
    window.event_simulate(type=name, value="PRESS", **place, **more)
    window.event_simulate(type=name, value="RELEASE", **place, **more)


def in_view(operator):
    """Invoked as by a button of the panel."""
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    region = next(r for r in area.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region):
        return operator("INVOKE_DEFAULT", True)


def attributes():
    return [a.name for a in bpy.data.objects["Ground"].data.color_attributes]


def cases():
    """Each yield lets Blender work for that many seconds."""
    from softshadow_blender import ask, operators, panel
    yield .5
    key("ESC")  # the splash screen, which takes keys
    yield .5
    drawn = []
    draw = panel.Panel.draw
    bpy.utils.unregister_class(panel.Panel)
    panel.Panel.bl_category = "Item"  # the tab that is open at first

    def counted(self, context):
        draw(self, context)
        drawn.append(self)
    panel.Panel.draw = counted
    bpy.utils.register_class(panel.Panel)
    for area in bpy.context.window_manager.windows[0].screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.show_region_ui = True
            area.tag_redraw()
    yield 1
    check(drawn, "the panel is drawn")

    bpy.ops.object.select_all(action="DESELECT")
    settings = bpy.context.scene.softshadow
    ground = scenes.ground(101)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=7, radius=.8, location=(0, 0, 1))
    scenes.select(ground)
    for light in [o for o in bpy.data.objects if o.type == "LIGHT"]:
        bpy.data.objects.remove(light)
    scenes.lamp("POINT", shadow_soft_size=.5)
    bpy.ops.ed.undo_push(message="made")
    yield .5

    settings.method, settings.tolerance, settings.image_size = "raytrace", 1e-4, 8192
    check(in_view(bpy.ops.softshadow.bake_image) == {"RUNNING_MODAL"}, "a long bake begins")
    begin = time.time()
    while operators._running and operators._running[0].done < ask.BUILD and time.time() < begin + 60:
        yield .1
    check(operators._running and operators._running[0].done >= ask.BUILD, "it tells its progress")
    check(not bpy.ops.softshadow.bake_attribute.poll(), "no second one may begin")
    begin = time.time()
    key("ESC")
    while operators._running and time.time() < begin + 60:
        yield .1
    # 67 million points of many rays each would take many minutes
    check(not operators._running and time.time() < begin + 30, "Esc ends it")
    check(not any(i.name.startswith("Visibility") for i in bpy.data.images), "and no image is left")

    settings.method, settings.tolerance = "auto", 1 / 256
    in_view(bpy.ops.softshadow.bake_attribute)
    begin = time.time()
    while operators._running and time.time() < begin + 60:
        yield .1
    check(attributes() == ["Visibility Lamp"], "a bake ends by itself")
    yield .5
    key("Z", ctrl=True)
    yield 1
    check(attributes() == [], "Ctrl-Z takes it back")


def main():
    host.enable()
    running = cases()

    def step():
        try:
            return next(running)
        except StopIteration:
            pass
        except Exception as error:
            found.append(repr(error))
            print("FAILED: %r" % error, flush=True)
        # Blender's own end writes a recovery file and may ask: this is a test's end
        sys.stdout.flush()
        os._exit(1 if found else 0)
    bpy.app.timers.register(step, first_interval=.5)


main()
