"""What calls answer, as plain dataclasses."""
from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, List, Tuple, Type, TypeVar

from . import _abi

Kind = TypeVar("Kind")
Array = Any  # numpy.ndarray where numpy can be imported, else array.array


def _fields(kind: Any) -> List[str]:
    return [field.name for field in dataclasses.fields(kind)]


def _plain(struct: Any, kind: Type[Kind]) -> Kind:
    """A dataclass from the struct's fields of the same names."""
    def python(value: Any) -> Any:
        if isinstance(value, bytes) or value is None:
            return _abi.text(value)
        return tuple(value) if hasattr(value, "__len__") else value
    return kind(**{name: python(getattr(struct, name)) for name in _fields(kind)})


@dataclass(frozen=True)
class Stats:
    """Sums since the last build. Times are in seconds, memory in bytes."""

    build_seconds: float
    query_seconds: float
    triangles: int  #: that cast
    casters_culled: int  #: triangles that no query could need and no map holds
    silhouette_edges: int
    points: int
    points_lit: int
    points_umbra: int
    points_penumbra: int
    points_traced: int  #: that any ray was spent on
    points_bad: int  #: not finite, beyond 1e15 or outside bounds: answered NaN
    rays: int
    map_bytes: int  #: held by what was built
    peak_bytes: int  #: most ever held
    method_used: str
    backend_used: str
    points_settled: int  #: told lit or dark before anything was drawn
    lod_triangles: int  #: triangles of coarser levels at hand; 0: none was used
    upload_seconds: float  #: of build and queries, spent on copies to the GPU
    download_seconds: float  #: and back
    depth_seconds: float  #: of build, spent on maps of the nearest depths
    silhouette_seconds: float  #: and on finding silhouettes


@dataclass(frozen=True)
class ErrorReport:
    """The method minus ray-traced truth over the points measured."""

    rms: float
    max: float
    p99: float
    mean: float
    reference_error: float  #: RMS error of the reference itself
    points: int  #: how many were measured


@dataclass(frozen=True)
class Map:
    """One plane of what was built; a copy, which stays.

    pixels  float32, shape (height, width, channels); without numpy flat, row after row
    matrix  16 numbers, row-major: world to clip space of the plane
    channel_names  what each channel holds; empty where the name says so itself
    light, face    whose it is; around a light inside the scene there are faces 0, 1, ...
    depth          depths in pixels are depth[0] + depth[1] * z / w of clip space; 1e30: nothing there
    origin, unit   of channels that end in .x .y .z: world = origin + value * unit
    """

    name: str
    width: int
    height: int
    channels: int
    pixels: Array
    matrix: Tuple[float, ...]
    channel_names: Tuple[str, ...] = ()
    light: int = 0
    face: int = 0
    depth: Tuple[float, float] = (0.0, 1.0)
    origin: Tuple[float, float, float] = (0.0, 0.0, 0.0)
    unit: float = 1.0


@dataclass(frozen=True)
class Method:
    """What a method is and takes.

    bound                what its error bound means: "none", "certified" or "statistical"
    lights_native        of "sphere", "disk", "rect", "sun": exactly as the method means it
    lights_approximated  likewise, by a stand-in that notes tells
    backends             where it runs: "cpu", "egl"
    """

    name: str
    title: str
    citation: str
    bound: str
    lights_native: Tuple[str, ...]
    lights_approximated: Tuple[str, ...]
    notes: str
    backends: Tuple[str, ...] = ("cpu",)


@dataclass(frozen=True)
class Backend:
    """Something that builds and answers. why is empty where it can be had."""

    name: str  #: "cpu" or "egl"
    device: str
    version: str
    why: str


@dataclass(frozen=True)
class MeshReport:
    """What a mesh is made of, after vertices in the same place were taken as one."""

    vertices: int
    triangles: int
    positions: int  #: vertices that differ
    degenerate_triangles: int  #: no area
    duplicate_triangles: int  #: same three positions as an earlier one
    edges: int
    boundary_edges: int  #: used by one triangle
    nonmanifold_edges: int  #: used by three triangles or more
    flipped_edges: int  #: used twice in the same direction
    nonmanifold_vertices: int  #: where more than one fan of triangles meets
    components: int  #: connected by edges
    closed_components: int  #: every edge used equally often in both directions
    silhouette_edges: int  #: as seen from the centre of light 0; 0 without a light
    bounds: Tuple[float, ...]  #: min x y z, max x y z, transformed


@dataclass(frozen=True)
class Explanation:
    """One point's view of a light, in double precision and by no method's approximation.

    visibility  from the pixels of the image, 0..1
    triangles   how many different triangles are in hiders
    image       float32, shape (size, size): 1 seen, 0 hidden, NaN not part of the light; row 0 is
                at +v, column 0 at -u of the light's frame. Without numpy flat
    hiders      uint64, the same shape: mesh_id << 32 | triangle that hides this spot, the nearest,
                or NO_PRIMITIVE. Without numpy flat
    centre, u, v  the light as the point sees it: centre and half axes
    """

    visibility: float
    triangles: int
    image: Array
    hiders: Array
    centre: Tuple[float, ...]
    u: Tuple[float, ...]
    v: Tuple[float, ...]


def stats_of(struct: Any) -> Stats:
    return _plain(struct, Stats)


def error_of(struct: Any) -> ErrorReport:
    return _plain(struct, ErrorReport)


def mesh_report_of(struct: Any) -> MeshReport:
    return _plain(struct, MeshReport)


def _lights(bits: int) -> Tuple[str, ...]:
    return tuple(name for i, name in enumerate(_abi.LIGHTS) if bits >> i & 1)


def method_of(struct: Any) -> Method:
    kind = struct.bound_kind
    return Method(_abi.text(struct.name), _abi.text(struct.title), _abi.text(struct.citation),
                  _abi.BOUNDS[kind] if kind < len(_abi.BOUNDS) else "unknown",
                  _lights(struct.lights_native), _lights(struct.lights_approximated),
                  _abi.text(struct.notes),
                  tuple(name for i, name in enumerate(_abi.BACKENDS) if struct.backends >> i & 1))


def backend_of(struct: Any) -> Backend:
    return Backend(*(_abi.text(getattr(struct, name))
                     for name in ("name", "device", "version", "why")))
