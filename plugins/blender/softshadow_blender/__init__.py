# SPDX-License-Identifier: Apache-2.0
"""Soft shadows by libsoftshadow: what fraction of each lamp is seen, baked to colour attributes or
images, or rendered as a preview from the scene's camera.

library.py finds the library, gather.py and lights.py read the scene, cover.py finds which surface
point each texel or pixel shows, ask.py puts the questions, results.py writes the answers. How much of
a light is seen is the library's business alone.
"""
from . import operators, panel, settings

bl_info = {
    "name": "Soft Shadow",
    "author": "The softshadow project",
    "version": (1, 0, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > Soft Shadow",
    "description": "Bakes and previews the fraction of each light that surfaces see",
    "category": "Render",
}

_modules = (settings, operators, panel)


def register():
    for module in _modules:
        module.register()


def unregister():
    for module in reversed(_modules):
        module.unregister()
