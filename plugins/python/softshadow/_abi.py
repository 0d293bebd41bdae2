"""The C side: every struct, constant and function of softshadow.h, in ctypes terms.

This is the one place that knows a layout; tests/plugins/python/layout.py holds it against the C
compiler's. Struct and field names are the header's.
"""
from __future__ import annotations

import ctypes
from ctypes import (CFUNCTYPE, POINTER, Structure, c_char_p, c_double, c_float, c_int, c_int32,
                    c_size_t, c_uint32, c_uint64, c_void_p)
from typing import Any, Dict, List, Tuple

VERSION_MAJOR = 1

STATUS = {
    0: "SOFTSHADOW_OK", -1: "SOFTSHADOW_E_ARGUMENT", -2: "SOFTSHADOW_E_STATE",
    -3: "SOFTSHADOW_E_MESH", -4: "SOFTSHADOW_E_LIGHT", -5: "SOFTSHADOW_E_MEMORY",
    -6: "SOFTSHADOW_E_UNSUPPORTED", -7: "SOFTSHADOW_E_CANCELLED", -8: "SOFTSHADOW_E_BACKEND",
    -9: "SOFTSHADOW_E_INTERNAL"}

F32, F64 = 0, 1
CASTS, RECEIVES, BORROW = 1, 2, 4
NO_PRIMITIVE = 2**64 - 1

# Names in Python for the numbers of the enums that take or give one of several.
LIGHTS = ("sphere", "disk", "rect", "sun")
BACKENDS = ("cpu", "egl", "any")
WEIGHTINGS = ("uniform", "solid_angle", "irradiance")
FALLOFFS = ("disk", "linear", "paper", "profile")
BOUNDS = ("none", "certified", "statistical")

Log = CFUNCTYPE(None, c_void_p, c_int, c_char_p)
Progress = CFUNCTYPE(c_int, c_void_p, c_double)
Body = CFUNCTYPE(None, c_void_p, c_uint64, c_uint64)
Parallel = CFUNCTYPE(None, c_void_p, c_uint64, Body, c_void_p)


class softshadow_options(Structure):
    _fields_ = [("struct_size", c_uint32), ("threads", c_uint32), ("user", c_void_p), ("log", Log),
                ("progress", Progress), ("parallel", Parallel)]


class softshadow_texture(Structure):
    _fields_ = [("width", c_uint32), ("height", c_uint32), ("texels", c_void_p)]


class softshadow_mesh(Structure):
    _fields_ = [("struct_size", c_uint32), ("flags", c_uint32), ("position_type", c_uint32),
                ("positions", c_void_p), ("position_stride", c_size_t), ("vertex_count", c_size_t),
                ("indices", c_void_p), ("triangle_count", c_size_t),
                ("transform", POINTER(c_double)), ("uvs", c_void_p), ("uv_stride", c_size_t),
                ("opacity", softshadow_texture), ("opacity_threshold", c_float)]


class softshadow_light(Structure):
    _fields_ = [("struct_size", c_uint32), ("type", c_uint32), ("position", c_double * 3),
                ("direction", c_double * 3), ("u", c_double * 3), ("v", c_double * 3),
                ("radius", c_double), ("profile", c_void_p), ("profile_count", c_uint32)]


class softshadow_build(Structure):
    _fields_ = [("struct_size", c_uint32), ("method", c_char_p), ("backend", c_uint32),
                ("samples", c_uint32), ("resolution", c_uint32), ("layers", c_uint32),
                ("max_samples", c_uint32), ("falloff", c_uint32), ("weighting", c_uint32),
                ("mask_taps", c_uint32), ("blur", c_uint32), ("seed", c_uint32),
                ("tolerance", c_double), ("depth_bias", c_double), ("smoothie_width", c_double),
                ("bounds", POINTER(c_double)), ("propagate", c_uint32),
                ("points_ahead", c_uint64), ("sub_lights", c_uint32)]


class softshadow_points(Structure):
    _fields_ = [("struct_size", c_uint32), ("position_type", c_uint32), ("positions", c_void_p),
                ("position_stride", c_size_t), ("count", c_size_t), ("normals", c_void_p),
                ("normal_stride", c_size_t), ("ids", c_void_p), ("primitives", c_void_p),
                ("width", c_uint32), ("light", c_uint32), ("error_bound", c_void_p)]


class softshadow_error(Structure):
    _fields_ = [("struct_size", c_uint32), ("max_points", c_uint64), ("samples", c_uint32),
                ("rms", c_double), ("max", c_double), ("p99", c_double), ("mean", c_double),
                ("reference_error", c_double), ("points", c_uint64)]


class softshadow_stats(Structure):
    _fields_ = [("struct_size", c_uint32), ("build_seconds", c_double), ("query_seconds", c_double),
                ("triangles", c_uint64), ("casters_culled", c_uint64),
                ("silhouette_edges", c_uint64), ("points", c_uint64), ("points_lit", c_uint64),
                ("points_umbra", c_uint64), ("points_penumbra", c_uint64),
                ("points_traced", c_uint64), ("points_bad", c_uint64), ("rays", c_uint64),
                ("map_bytes", c_uint64), ("peak_bytes", c_uint64), ("method_used", c_char_p),
                ("backend_used", c_char_p), ("points_settled", c_uint64),
                ("lod_triangles", c_uint64), ("upload_seconds", c_double),
                ("download_seconds", c_double), ("depth_seconds", c_double),
                ("silhouette_seconds", c_double)]


class softshadow_map(Structure):
    _fields_ = [("struct_size", c_uint32), ("name", c_char_p), ("width", c_uint32),
                ("height", c_uint32), ("channels", c_uint32), ("pixels", c_void_p),
                ("matrix", c_double * 16), ("channel_names", c_char_p), ("light", c_uint32),
                ("face", c_uint32), ("depth", c_double * 2), ("origin", c_double * 3),
                ("unit", c_double)]


class softshadow_method(Structure):
    _fields_ = [("struct_size", c_uint32), ("name", c_char_p), ("title", c_char_p),
                ("citation", c_char_p), ("bound_kind", c_uint32), ("lights_native", c_uint32),
                ("lights_approximated", c_uint32), ("notes", c_char_p), ("backends", c_uint32)]


class softshadow_backend(Structure):
    _fields_ = [("struct_size", c_uint32), ("status", c_int32), ("name", c_char_p),
                ("device", c_char_p), ("version", c_char_p), ("why", c_char_p)]


class softshadow_mesh_report(Structure):
    _fields_ = [("struct_size", c_uint32), ("vertices", c_uint64), ("triangles", c_uint64),
                ("positions", c_uint64), ("degenerate_triangles", c_uint64),
                ("duplicate_triangles", c_uint64), ("edges", c_uint64),
                ("boundary_edges", c_uint64), ("nonmanifold_edges", c_uint64),
                ("flipped_edges", c_uint64), ("nonmanifold_vertices", c_uint64),
                ("components", c_uint64), ("closed_components", c_uint64),
                ("silhouette_edges", c_uint64), ("bounds", c_double * 6)]


class softshadow_explanation(Structure):
    _fields_ = [("struct_size", c_uint32), ("point", c_double * 3), ("normal", POINTER(c_float)),
                ("primitive", POINTER(c_uint64)), ("light", c_uint32), ("size", c_uint32),
                ("image", c_void_p), ("hider", c_void_p), ("visibility", c_float),
                ("triangles", c_uint64), ("centre", c_double * 3), ("u", c_double * 3),
                ("v", c_double * 3)]


STRUCTS = (softshadow_options, softshadow_texture, softshadow_mesh, softshadow_light,
           softshadow_build, softshadow_points, softshadow_error, softshadow_stats, softshadow_map,
           softshadow_method, softshadow_backend, softshadow_mesh_report, softshadow_explanation)

_handle, _status, _id = c_void_p, c_int32, POINTER(c_uint32)

# name: (result, arguments)
FUNCTIONS: Dict[str, Tuple[Any, List[Any]]] = {
    "softshadow_version": (c_uint32, []),
    "softshadow_version_string": (c_char_p, []),
    "softshadow_status_name": (c_char_p, [_status]),
    "softshadow_last_message": (c_char_p, [_handle]),
    "softshadow_create": (_status, [POINTER(_handle), POINTER(softshadow_options)]),
    "softshadow_destroy": (None, [_handle]),
    "softshadow_add_mesh": (_status, [_handle, POINTER(softshadow_mesh), _id]),
    "softshadow_update_mesh": (_status, [_handle, c_uint32, POINTER(softshadow_mesh)]),
    "softshadow_remove_mesh": (_status, [_handle, c_uint32]),
    "softshadow_set_light": (_status, [_handle, POINTER(softshadow_light)]),
    "softshadow_add_light": (_status, [_handle, POINTER(softshadow_light), _id]),
    "softshadow_build_maps": (_status, [_handle, POINTER(softshadow_build)]),
    "softshadow_query_visibility": (_status, [_handle, POINTER(softshadow_points), c_void_p]),
    "softshadow_measure_error": (_status, [_handle, POINTER(softshadow_points),
                                           POINTER(softshadow_error)]),
    "softshadow_get_stats": (_status, [_handle, POINTER(softshadow_stats)]),
    "softshadow_map_count": (_status, [_handle, POINTER(c_uint32)]),
    "softshadow_get_map": (_status, [_handle, c_uint32, POINTER(softshadow_map)]),
    "softshadow_method_count": (_status, [POINTER(c_uint32)]),
    "softshadow_method_info": (_status, [c_uint32, POINTER(softshadow_method)]),
    "softshadow_backend_info": (_status, [c_uint32, POINTER(softshadow_backend)]),
    "softshadow_mesh_info": (_status, [_handle, c_uint32, POINTER(softshadow_mesh_report)]),
    "softshadow_explain": (_status, [_handle, POINTER(softshadow_explanation)]),
}


def declare(library: ctypes.CDLL) -> ctypes.CDLL:
    """Gives every function its types; AttributeError names one that the library lacks."""
    for name, (result, arguments) in FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


def sized(struct: Any) -> Any:
    """A struct of that type with its size set and all else zero, the defaults."""
    return struct(struct_size=ctypes.sizeof(struct))


def text(given: Any) -> str:
    """A C string as Python's; NULL is empty."""
    return str(given, "utf-8", "replace") if given else ""
