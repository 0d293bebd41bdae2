#!/usr/bin/env python3
"""The add-on without the library: it loads, tells what is missing and where it was looked for, and works
as soon as its preferences name a library."""
import os
import sys
import types
import unittest

import host

try:
    import bpy
except ImportError:
    host.check_host()
    sys.exit(host.run(__file__, SOFTSHADOW_LIBRARY="/nowhere/libsoftshadow.so.1",
                      SOFTSHADOW_THERE=os.path.join(host.BUILD, ".libs", "libsoftshadow.so.1")))

import scenes


class Missing(unittest.TestCase):
    def setUp(self):
        scenes.empty()
        self.ground = scenes.ground(3)
        scenes.lamp("SUN", angle=.1)
        scenes.select(self.ground)

    def refused(self):
        with self.assertRaises(RuntimeError) as raised:
            bpy.ops.softshadow.bake_attribute()
        return str(raised.exception)

    def test_missing(self):
        from softshadow_blender import library
        message = self.refused()
        for part in "the library was not found", "SOFTSHADOW_LIBRARY", "/nowhere/libsoftshadow.so.1":
            self.assertIn(part, message)
        self.assertFalse(self.ground.data.color_attributes)
        # The variable names one library or none; without it the preference does, then what was
        # installed.
        del os.environ["SOFTSHADOW_LIBRARY"]
        preferences = bpy.context.preferences.addons[host.ADDON].preferences
        preferences.library = "/elsewhere/libsoftshadow.so.1"
        message = self.refused()
        self.assertIn("/elsewhere/libsoftshadow.so.1", message)
        self.assertNotIn("SOFTSHADOW_LIBRARY", os.environ)
        there = os.environ["SOFTSHADOW_THERE"]
        preferences.library = there
        self.assertEqual(bpy.ops.softshadow.bake_attribute(), {"FINISHED"})
        self.assertEqual(scenes.attribute(self.ground, "Visibility Lamp").tolist(), [1] * 9)
        package, why = library.load()
        self.assertEqual((package.version_info()[0], why), (1, ""))
        with open("/proc/self/maps") as maps:
            self.assertIn(os.path.realpath(there), maps.read())
        # Another path means nothing to a process that has loaded its library: the preferences say so.
        for path, said in (there, False), ("/elsewhere/libsoftshadow.so.1", True), (there, False):
            preferences.library = path
            labels = self.drawn()
            self.assertIn("Library version " + package.version(), labels)
            self.assertEqual("Another library takes effect when Blender starts again" in labels, said)

    def drawn(self):
        """What the preferences show, as text."""
        from softshadow_blender import settings
        labels = []
        layout = types.SimpleNamespace(prop=lambda *_: None, label=lambda text, icon: labels.append(text),
                                       column=lambda: layout)
        settings.Preferences.draw(types.SimpleNamespace(layout=layout), None)
        return labels


host.main()
