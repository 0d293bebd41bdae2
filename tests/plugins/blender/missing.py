#!/usr/bin/env python3
"""The add-on without the library: it loads, tells what is missing and where it was looked for, and works
as soon as its preferences name a library."""
import os
import sys
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


host.main()
