# SPDX-License-Identifier: Apache-2.0
"""What the user sets: for the scene, and the library's place for the add-on."""
import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import library

_methods = []  # Blender keeps no reference to the texts of a computed list


def _method_items(_self, _context):
    package, _ = library.load()
    if not _methods and package:
        _methods.extend((m.name, m.name, m.title, n) for n, m in enumerate(package.methods(), 1))
    return [("auto", "auto", "What suits the scene and the tolerance", 0)] + [
        item for item in _methods if item[0] != "auto"]


class Settings(bpy.types.PropertyGroup):
    lights: EnumProperty(
        name="Lights", items=(("ALL", "All", "Every light that the viewport shows"),
                              ("SELECTED", "Selected", "Selected lights only")))
    method: EnumProperty(name="Method", items=_method_items,
                         description="How visibility is found")
    weighting: EnumProperty(
        name="Weighting", description="How much each part of a light counts",
        items=(("UNIFORM", "Area", "The visible part of the light's area"),
               ("SOLID_ANGLE", "Solid Angle", "By how large each part looks"),
               ("IRRADIANCE", "Irradiance", "By how much each part lights a diffuse surface: what "
                "a path tracer's shadowed light is of its unshadowed light")))
    tolerance: FloatProperty(name="Tolerance", default=1 / 256, min=1e-4, max=0.25, precision=4,
                             description="Wanted RMS error in penumbra")
    domain: EnumProperty(
        name="Domain", items=(("POINT", "Vertex", "One value a vertex"),
                              ("CORNER", "Face Corner", "One value a corner: sharp at hard edges")))
    image_size: IntProperty(name="Size", default=1024, min=1, max=16384, subtype="PIXEL",
                            description="Side of the baked image")
    margin: IntProperty(name="Margin", default=4, min=0, max=64, subtype="PIXEL",
                        description="How far the image goes on beyond the edges of UV islands")
    percentage: IntProperty(name="Resolution", default=50, min=1, max=400, subtype="PERCENTAGE",
                            description="Of the render's resolution")
    oversampling: IntProperty(name="Oversampling", default=2, min=1, max=8,
                              description="Points along each side of a pixel")
    content: EnumProperty(
        name="Content", items=(("LIT", "Lit", "Diffuse surfaces under the lights"),
                               ("VISIBILITY", "Visibility", "The lights' mean visibility, grey")))


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__
    library: StringProperty(name="Library", subtype="FILE_PATH", update=library.retry,
                            description="libsoftshadow.so.1; empty: where it was installed")

    def draw(self, _context):
        self.layout.prop(self, "library")
        package, why = library.load()
        column = self.layout.column()
        if package:
            column.label(text="Library version " + package.version(), icon="CHECKMARK")
            if library.pending():
                column.label(text="Another library takes effect when Blender starts again", icon="INFO")
        else:
            column.label(text=why, icon="ERROR")


_classes = (Settings, Preferences)


def register():
    for each in _classes:
        bpy.utils.register_class(each)
    bpy.types.Scene.softshadow = PointerProperty(type=Settings)


def unregister():
    del bpy.types.Scene.softshadow
    for each in reversed(_classes):
        bpy.utils.unregister_class(each)
