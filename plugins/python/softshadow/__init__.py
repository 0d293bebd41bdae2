"""softshadow: how much of a light does this point see?

You give triangle meshes and area lights; you ask, for any batch of points, what fraction of a light
each point sees: 1 is fully lit, 0 is umbra, between them is penumbra.

    import softshadow

    with softshadow.Scene() as scene:
        scene.add_mesh([(-1, 1, -1), (1, 1, -1), (0, 1, 1)], [(0, 1, 2)])
        scene.set_light(softshadow.Sphere((0, 4, 0), 0.5))
        scene.build()
        print(scene.visibility([(0, 0, 0), (0.6, 0, 0), (3, 0, 0)]))

This package is a face of libsoftshadow.so.1 and computes nothing itself. It finds the library by
SOFTSHADOW_LIBRARY (a file), else where it was installed, else as the system finds libraries.

Arrays     are read in place wherever the library can: float32 or float64 points of shape (N, 3),
           any row stride, as numpy array, array.array, memoryview, ctypes array or bytes (float32).
           Flat arrays of 3 N numbers are fine; sequences and other types are copied. Results are
           numpy arrays if numpy can be imported, else array.array.
Units      Lengths are in the scene's own unit, angles are radians; sizes of lights are radii and
           HALF axes.
Errors     are exceptions below softshadow.Error that carry the library's message.
Threads    Other Python threads run during every call. Once a scene is built, any number of threads
           may query it.
"""
from __future__ import annotations

from ._abi import NO_PRIMITIVE
from ._errors import (ArgumentError, BackendError, CancelledError, Error, InternalError, LightError,
                      MeshError, OutOfMemoryError, StateError, UnsupportedError)
from ._lights import Disk, Ellipse, Light, Rect, Sphere, Sun
from ._results import Backend, ErrorReport, Explanation, Map, MeshReport, Method, Stats
from ._scene import Scene, backends, methods, primitive, version, version_info

__all__ = [
    "ArgumentError", "Backend", "BackendError", "CancelledError", "Disk", "Ellipse", "Error",
    "ErrorReport",
    "Explanation", "InternalError", "Light", "LightError", "Map", "MeshError", "MeshReport",
    "Method", "NO_PRIMITIVE", "OutOfMemoryError", "Rect", "Scene", "Sphere", "StateError", "Stats",
    "Sun", "UnsupportedError", "backends", "methods", "primitive", "version", "version_info"]
