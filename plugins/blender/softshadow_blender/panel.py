# SPDX-License-Identifier: Apache-2.0
"""The panel in the sidebar of the 3D view."""
import bpy

from . import library, operators


class Panel(bpy.types.Panel):
    bl_idname = "VIEW3D_PT_softshadow"
    bl_label = "Soft Shadow"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Soft Shadow"

    def draw(self, context):
        layout, settings = self.layout, context.scene.softshadow
        layout.use_property_split = True
        package, why = library.load()
        if not package:
            box = layout.box()
            box.label(text="The library was not found", icon="ERROR")
            box.label(text="Set its place in the add-on's preferences")
            box.label(text=why)
            return
        for name in ("lights", "method", "weighting", "tolerance"):
            layout.prop(settings, name)
        _group(layout, settings, operators.BakeAttribute, "GROUP_VCOL", "domain")
        _group(layout, settings, operators.BakeImage, "IMAGE_DATA", "image_size", "margin")
        _group(layout, settings, operators.Preview, "RENDER_STILL", "percentage", "oversampling",
               "content")


def _group(layout, settings, operator, icon, *names):
    column = layout.box().column()
    for name in names:
        column.prop(settings, name)
    column.operator_context = "INVOKE_DEFAULT"
    column.operator(operator.bl_idname, icon=icon)


def register():
    bpy.utils.register_class(Panel)


def unregister():
    bpy.utils.unregister_class(Panel)
