"""A scene: meshes, lights, what is built from them, and the questions to ask it."""
from __future__ import annotations

import ctypes
import threading
import weakref
from contextlib import contextmanager
from ctypes import byref
from typing import Any, Dict, Iterator, List, Optional, Tuple

from . import _abi, _buffers, _results
from ._errors import ArgumentError, CancelledError, InternalError, StateError, error_of
from ._host import Host, LogFunction, ParallelFunction, ProgressFunction
from ._lights import Light, struct_of
from ._load import library

FLOATS = ("float64", "float32")
INDICES = ("uint32", "int32")  # the same bits below 2^31; what is negative is out of range


def version() -> str:
    """The version of the library that runs, such as "1.0.0"."""
    return _abi.text(library.softshadow_version_string())


def version_info() -> Tuple[int, int, int]:
    """The version of the library that runs as (major, minor, patch)."""
    number = library.softshadow_version()
    return number // 10000, number // 100 % 100, number % 100


def methods() -> List[_results.Method]:
    """The methods the library has, in its order."""
    count, found = ctypes.c_uint32(), []
    _check(library.softshadow_method_count(byref(count)), None)
    for index in range(count.value):
        method = _abi.sized(_abi.softshadow_method)
        _check(library.softshadow_method_info(index, byref(method)), None)
        found.append(_results.method_of(method))
    return found


def backends() -> List[_results.Backend]:
    """What builds and answers: the CPU and the GPU, and why not. Makes the GPU's context."""
    found = []
    for index in range(2):
        backend = _abi.sized(_abi.softshadow_backend)
        _check(library.softshadow_backend_info(index, byref(backend)), None)
        found.append(_results.backend_of(backend))
    return found


def primitive(mesh_id: int, triangle: int) -> int:
    """The number by which points and hiders name a triangle: mesh_id << 32 | triangle."""
    return _buffers.whole(mesh_id, "mesh_id") << 32 | _buffers.whole(triangle, "triangle")


def _check(status: int, handle: Any) -> None:
    if status:
        raise error_of(status, handle)


def _doubles(value: Any, name: str, *counts: int) -> Any:
    numbers = _buffers.reals(value, name, *counts)
    return (ctypes.c_double * len(numbers))(*numbers)


def _transform(value: Any) -> Any:
    numbers = _buffers.reals(value, "transform", 12, 16)
    if numbers[12:] not in ([], [0, 0, 0, 1]):
        raise ArgumentError("transform: the last row is %s, must be 0 0 0 1" % numbers[12:])
    return (ctypes.c_double * 12)(*numbers[:12])


def _opacity(mesh: Any, value: Any, threshold: float) -> _buffers.Held:
    held = _buffers.hold(value, "opacity", 1, ("uint8",), packed=True)
    if len(held.shape) != 2:
        raise ArgumentError("opacity: shape %s, must be (height, width)" % (held.shape,))
    mesh.opacity.height, mesh.opacity.width = held.shape
    mesh.opacity.texels = held.address
    mesh.opacity_threshold = _buffers.real(threshold, "opacity_threshold")
    return held


def _mesh(positions: Any, indices: Any, transform: Any, casts: bool, receives: bool, uvs: Any,
          opacity: Any, opacity_threshold: float, borrow: bool) -> Tuple[Any, List[Any]]:
    """The struct, and what must be kept while it is read."""
    if not casts and not receives:
        raise ArgumentError("casts, receives: both False, one must be True")
    vertices = _buffers.hold(positions, "positions", 3, FLOATS, raw="float32")
    triangles = _buffers.hold(indices, "indices", 3, INDICES, packed=True)
    mesh = _abi.sized(_abi.softshadow_mesh)
    mesh.flags = ((_abi.CASTS if casts else 0) | (_abi.RECEIVES if receives else 0) |
                  (_abi.BORROW if borrow else 0))
    mesh.position_type = _abi.F64 if vertices.kind == "float64" else _abi.F32
    mesh.positions, mesh.position_stride = vertices.address, vertices.stride
    mesh.vertex_count = vertices.count
    mesh.indices, mesh.triangle_count = triangles.address, triangles.count
    keep: List[Any] = [vertices, triangles]
    if transform is not None:
        mesh.transform = _transform(transform)
    if uvs is not None:
        held = _buffers.hold(uvs, "uvs", 2, ("float32",))
        if held.count != vertices.count:
            raise ArgumentError("uvs: %d of them for %d vertices" % (held.count, vertices.count))
        mesh.uvs, mesh.uv_stride = held.address, held.stride
        keep.append(held)
    if opacity is not None:
        if uvs is None:
            raise ArgumentError("opacity: needs uvs")
        keep.append(_opacity(mesh, opacity, opacity_threshold))
    return mesh, keep


class _Batch:
    """Points as the library takes them, and what must be kept while it reads them."""

    def __init__(self, points: Any, normals: Any, primitives: Any, ids: Any, width: Optional[int],
                 light: int) -> None:
        held = _buffers.hold(points, "points", 3, FLOATS, raw="float32")
        self.count, self.shape, self.inputs = held.count, held.shape, [held]
        struct = self.struct = _abi.sized(_abi.softshadow_points)
        struct.position_type = _abi.F64 if held.kind == "float64" else _abi.F32
        struct.positions, struct.position_stride = held.address, held.stride
        struct.count = held.count
        if normals is not None:
            each = self._each(normals, "normals", 3, ("float32",))
            struct.normals, struct.normal_stride = each.address, each.stride
        if primitives is not None:
            struct.primitives = self._each(primitives, "primitives", 1, ("uint64", "int64")).address
        if ids is not None:
            struct.ids = self._each(ids, "ids", 1, INDICES).address
        if width is None:
            width = self.shape[-1] if len(self.shape) == 2 else 0
        struct.width = _buffers.whole(width, "width")
        struct.light = _buffers.whole(light, "light")

    def _each(self, value: Any, name: str, columns: int, kinds: Tuple[str, ...]) -> _buffers.Held:
        held = _buffers.hold(value, name, columns, kinds, packed=columns == 1)
        if held.count != self.count:
            raise ArgumentError("%s: shape %s, there are %d of them for %d points" % (
                name, held.shape + ((columns,) if columns > 1 else ()), held.count, self.count))
        self.inputs.append(held)
        return held

    def output(self, given: Any) -> Tuple[Any, _buffers.Held]:
        """A new array for one number a point, or the caller's."""
        if given is None:
            return _buffers.new_output("float32", self.shape)
        held = _buffers.hold_output(given, "out", self.count)
        if any(held.overlaps(other) for other in self.inputs):
            raise ArgumentError("out: overlaps an input, must be memory of its own")
        return given, held


class Scene:
    """Meshes and lights, and what was built from them.

    threads   how many threads a call may use, its own included; 0: one per processor
    log       log(level, text): one line of text; level 0 error, 1 warning, 2 information. Any
              thread. What it raises goes to sys.unraisablehook
    progress  progress(done): now and then with done in 0..1 while a call works. A true answer
              cancels that call: CancelledError. What it raises cancels, too, and comes out of the
              call. Any thread, one at a time; it must not use this scene
    parallel  parallel(count, run): your scheduler: calls run(begin, end) for ranges that together
              cover 0..count, on as many threads as it likes, and returns when all are done

    Use it in a with statement, or close() it; a scene that nobody refers to closes itself. Any
    number of threads may query a built scene; a call that changes it while another one uses it
    raises StateError.
    """

    def __init__(self, *, threads: int = 0, log: Optional[LogFunction] = None,
                 progress: Optional[ProgressFunction] = None,
                 parallel: Optional[ParallelFunction] = None) -> None:
        self._host = Host(_buffers.whole(threads, "threads"), log, progress, parallel)
        self._borrowed: Dict[int, List[Any]] = {}
        self._lock = threading.RLock()
        self._maps_lock = threading.Lock()
        self._users = 0
        handle = ctypes.c_void_p()
        _check(library.softshadow_create(byref(handle), byref(self._host.options)), None)
        self._handle = handle
        # Host and borrowed arrays are arguments so that they outlive the handle.
        self._close = weakref.finalize(self, _destroy, handle, self._host, self._borrowed)
        # A daemon thread may be inside when the interpreter ends: leave it to the process's end.
        self._close.atexit = False

    # ---- a handle's life ----

    def __enter__(self) -> "Scene":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    @property
    def closed(self) -> bool:
        return not self._close.alive

    def close(self) -> None:
        """Frees all; a second time does nothing. Errors: StateError while a call uses it."""
        with self._lock:
            if self._users:
                raise StateError("close: %d calls still use this scene" % self._users)
            self._close()

    @contextmanager
    def _in_use(self) -> Iterator[Any]:
        with self._lock:
            if self.closed:
                raise StateError("this scene is closed")
            self._users += 1
        try:
            yield self._handle
        finally:
            with self._lock:
                self._users -= 1

    def _call(self, function: Any, *arguments: Any) -> None:
        with self._in_use() as handle:
            status = function(handle, *arguments)
            if not status:
                return
            error = error_of(status, handle)
        if isinstance(error, (CancelledError, InternalError)) and self._host.raised:
            raise self._host.raised.pop(0)
        raise error

    # ---- the scene ----

    def add_mesh(self, positions: Any, indices: Any, *, transform: Any = None, casts: bool = True,
                 receives: bool = True, uvs: Any = None, opacity: Any = None,
                 opacity_threshold: float = 0.5, borrow: bool = False) -> int:
        """Adds triangles; any soup will do. Returns the mesh's id: 0, 1, ..., never used again.

        positions   (N, 3) float32 or float64, finite, within +-1e15; any row stride
        indices     (M, 3) whole numbers below N; uint32 and int32 are read in place
        transform   12 numbers, rows of [A | t] (x' = A x + t), or 16 with a last row of 0 0 0 1
        casts       whether it hides the lights
        receives    whether points lie on it
        uvs         (N, 2) float32: places in the opacity image, which repeats; v = 0: first row
        opacity     (height, width) uint8; a spot casts where texel / 255 >= opacity_threshold
        borrow      the arrays are not copied: they must stay as they are until the mesh is updated
                    or removed or the scene closed. They are kept alive; arrays of other types or
                    layouts are copied all the same

        Errors: MeshError with the number of the first vertex or triangle that cannot be used;
        ArgumentError, OutOfMemoryError; StateError while a query runs.
        """
        mesh, keep = _mesh(positions, indices, transform, casts, receives, uvs, opacity,
                           opacity_threshold, borrow)
        mesh_id = ctypes.c_uint32()
        self._call(library.softshadow_add_mesh, byref(mesh), byref(mesh_id))
        if borrow:
            self._borrowed[mesh_id.value] = keep
        return mesh_id.value

    def update_mesh(self, mesh_id: int, positions: Any, indices: Any, *, transform: Any = None,
                    casts: bool = True, receives: bool = True, uvs: Any = None,
                    opacity: Any = None, opacity_threshold: float = 0.5,
                    borrow: bool = False) -> None:
        """Puts another mesh in the place of mesh_id; the rest is as in add_mesh(). Refused, the
        scene stays as it was."""
        mesh_id = _buffers.whole(mesh_id, "mesh_id")
        mesh, keep = _mesh(positions, indices, transform, casts, receives, uvs, opacity,
                           opacity_threshold, borrow)
        self._call(library.softshadow_update_mesh, mesh_id, byref(mesh))
        self._borrowed.pop(mesh_id, None)
        if borrow:
            self._borrowed[mesh_id] = keep

    def remove_mesh(self, mesh_id: int) -> None:
        """Takes a mesh out. Errors: ArgumentError for an id that is none, StateError."""
        mesh_id = _buffers.whole(mesh_id, "mesh_id")
        self._call(library.softshadow_remove_mesh, mesh_id)
        self._borrowed.pop(mesh_id, None)

    def set_light(self, light: Light) -> None:
        """Makes this the only light, id 0. Errors: LightError, ArgumentError, StateError."""
        struct, _keep = struct_of(light)
        self._call(library.softshadow_set_light, byref(struct))

    def add_light(self, light: Light) -> int:
        """Adds a further light; returns its id for the light argument of queries."""
        struct, _keep = struct_of(light)
        light_id = ctypes.c_uint32()
        self._call(library.softshadow_add_light, byref(struct), byref(light_id))
        return light_id.value

    # ---- build and ask ----

    def build(self, method: Optional[str] = None, *, backend: str = "cpu", samples: int = 0,
              resolution: int = 0, layers: int = 0, max_samples: int = 0, falloff: str = "disk",
              weighting: str = "uniform", mask_taps: int = 0, blur: int = 0, seed: int = 0,
              tolerance: float = 0, depth_bias: float = 0, smoothie_width: float = 0,
              bounds: Any = None, propagate: bool = False, points_ahead: int = 0,
              sub_lights: int = 0) -> None:
        """Prepares a method for the scene and its lights; builds again only what has become stale.

        Every default is the library's.

        method          a name that methods() lists; None: "auto"
        backend         "cpu", "egl" or "any" (the GPU if there is one, else the CPU)
        samples         light samples a point; 0: what tolerance needs
        resolution      side of a map in texels; 0: 1024
        layers          depth layers of "backprojection"; 0: 3
        max_samples     most texels a back-projection or a filter visits; 0: all
        falloff         "disk", "linear", "paper" or "profile"
        weighting       "uniform", "solid_angle" or "irradiance" (needs normals)
        mask_taps       of "penumbra-mask": taps along a side; 0: 8
        blur            of "penumbra-mask": over how many pixels along image rows (1: over 12)
        seed            turns the sample pattern of "raytrace" and "penumbra-mask"
        tolerance       wanted RMS error of a point in penumbra; 0: 1/256
        depth_bias      length, for methods that compare depths; 0: their own
        smoothie_width  tangent units; 0: R/b
        bounds          6 numbers: min x y z, max x y z of all points to be asked; None: anywhere
        propagate       of "penumbra-limit": from the depth image instead of from silhouettes
        points_ahead    about how many points will be asked in all while the meshes stay; 0: unknown.
                        Many make "auto" spend time on coarser levels of dense meshes
        sub_lights      of "penumbra-volume" and "penumbra-mask": the light is divided in so many along
                        each of two sides; 0: 1

        Errors: ArgumentError, UnsupportedError, StateError without a light, CancelledError,
        BackendError when Embree or a driver is missing, OutOfMemoryError. After an error nothing is
        built.
        """
        struct = _abi.sized(_abi.softshadow_build)
        struct.method = None if method is None else method.encode()
        struct.backend = _buffers.choice(backend, "backend", _abi.BACKENDS)
        struct.falloff = _buffers.choice(falloff, "falloff", _abi.FALLOFFS)
        struct.weighting = _buffers.choice(weighting, "weighting", _abi.WEIGHTINGS)
        numbers = dict(samples=samples, resolution=resolution, layers=layers,
                       max_samples=max_samples, mask_taps=mask_taps, blur=blur, seed=seed,
                       propagate=propagate, points_ahead=points_ahead,
                       sub_lights=sub_lights)
        for name, number in numbers.items():
            setattr(struct, name, _buffers.whole(number, name))
        struct.tolerance = _buffers.real(tolerance, "tolerance")
        struct.depth_bias = _buffers.real(depth_bias, "depth_bias")
        struct.smoothie_width = _buffers.real(smoothie_width, "smoothie_width")
        if bounds is not None:
            struct.bounds = _doubles(bounds, "bounds", 6)
        if not self._maps_lock.acquire(blocking=False):
            raise StateError("build: another thread builds this scene or reads its maps")
        try:
            self._call(library.softshadow_build_maps, byref(struct))
        finally:
            self._maps_lock.release()

    def visibility(self, points: Any, *, normals: Any = None, primitives: Any = None,
                   ids: Any = None, width: Optional[int] = None, light: int = 0, out: Any = None,
                   error_bound: bool = False) -> Any:
        """The fraction of a light that each point sees: float32, 0 umbra .. 1 lit.

        points      (N, 3) float32 or float64, or an image (rows, columns, 3)
        normals     as many (.., 3) float32, any length, 0 0 0: none. What lies below a point's
                    horizon is hidden
        primitives  as many uint64, primitive(mesh_id, triangle) each point lies on, or NO_PRIMITIVE
        ids         as many uint32: objects that a blur must not cross
        width       > 0: the points are rows of an image; None: of (rows, columns, 3), columns
        light       which light: an id
        out         writable float32 memory for N results; None: a new array
        error_bound whether to return (visibility, error_bound): how far the truth may be, as
                    methods() tell in bound; NaN for methods that have none

        The answer has the shape of points less the last axis (without numpy it is flat). NaN for a
        point that is not finite, beyond 1e15 or outside the bounds given to build().
        Errors: StateError before build() or after the scene changed; ArgumentError, CancelledError,
        OutOfMemoryError; out is all NaN then.
        """
        batch = _Batch(points, normals, primitives, ids, width, light)
        result, held = batch.output(out)
        bound, bound_held = batch.output(None) if error_bound else (None, None)
        if bound_held is not None:
            batch.struct.error_bound = bound_held.address
        self._call(library.softshadow_query_visibility, byref(batch.struct), held.address)
        return (result, bound) if error_bound else result

    def measure_error(self, points: Any, *, normals: Any = None, primitives: Any = None,
                      ids: Any = None, width: Optional[int] = None, light: int = 0,
                      max_points: int = 0, samples: int = 0) -> _results.ErrorReport:
        """Compares what was built with ray-traced truth on evenly chosen points of the batch.

        points .. light  as in visibility()
        max_points       at most so many of the points; 0: all
        samples          rays a point for the reference; 0: 4096

        Errors: as visibility(), and BackendError without Embree.
        """
        batch = _Batch(points, normals, primitives, ids, width, light)
        error = _abi.sized(_abi.softshadow_error)
        error.max_points = _buffers.whole(max_points, "max_points", 2**64 - 1)
        error.samples = _buffers.whole(samples, "samples")
        self._call(library.softshadow_measure_error, byref(batch.struct), byref(error))
        return _results.error_of(error)

    # ---- looking inside ----

    def stats(self) -> _results.Stats:
        """Sums since the last build."""
        stats = _abi.sized(_abi.softshadow_stats)
        self._call(library.softshadow_get_stats, byref(stats))
        return _results.stats_of(stats)

    def maps(self) -> List[_results.Map]:
        """Copies of the planes that the build made; methods without maps have none."""
        if not self._maps_lock.acquire(blocking=False):
            raise StateError("maps: another thread builds this scene or reads its maps")
        try:
            count = ctypes.c_uint32()
            self._call(library.softshadow_map_count, byref(count))
            return [self._map(index) for index in range(count.value)]
        finally:
            self._maps_lock.release()

    def _map(self, index: int) -> _results.Map:
        plane = _abi.sized(_abi.softshadow_map)
        with self._in_use():
            self._call(library.softshadow_get_map, index, byref(plane))
            pixels = _buffers.copy_out(plane.pixels, "float32",
                                       (plane.height, plane.width, plane.channels))
            names = _abi.text(plane.channel_names) if plane.channel_names else ""
            return _results.Map(_abi.text(plane.name), plane.width, plane.height, plane.channels,
                                pixels, tuple(plane.matrix), tuple(names.split(",") if names else ()),
                                plane.light, plane.face, tuple(plane.depth), tuple(plane.origin),
                                plane.unit)

    def mesh_info(self, mesh_id: int) -> _results.MeshReport:
        """Counts what a mesh is made of; works before any build."""
        report = _abi.sized(_abi.softshadow_mesh_report)
        self._call(library.softshadow_mesh_info, _buffers.whole(mesh_id, "mesh_id"),
                   byref(report))
        return _results.mesh_report_of(report)

    def explain(self, point: Any, *, normal: Any = None, primitive: Optional[int] = None,
                light: int = 0, size: int = 64) -> _results.Explanation:
        """Draws the light as one point sees it and names the triangles that hide it.

        point      3 numbers
        normal     3 numbers; what lies below the point's horizon is hidden
        primitive  the triangle the point lies on, see primitive()
        light      which light: an id
        size       side of the image in pixels, 1..4096

        Needs a built scene; errors as visibility().
        """
        struct = _abi.sized(_abi.softshadow_explanation)
        struct.point[:] = _buffers.reals(point, "point", 3)
        struct.light = _buffers.whole(light, "light")
        struct.size = _buffers.whole(size, "size", 4096)
        if normal is not None:
            struct.normal = (ctypes.c_float * 3)(*_buffers.reals(normal, "normal", 3))
        if primitive is not None:
            struct.primitive = (ctypes.c_uint64 * 1)(
                _buffers.whole(primitive, "primitive", _abi.NO_PRIMITIVE))
        image, image_held = _buffers.new_output("float32", (struct.size, struct.size))
        hiders, hiders_held = _buffers.new_output("uint64", (struct.size, struct.size))
        struct.image, struct.hider = image_held.address, hiders_held.address
        self._call(library.softshadow_explain, byref(struct))
        return _results.Explanation(struct.visibility, struct.triangles, image, hiders,
                                    tuple(struct.centre), tuple(struct.u), tuple(struct.v))


def _destroy(handle: Any, _host: Host, borrowed: Dict[int, List[Any]]) -> None:
    library.softshadow_destroy(handle)
    borrowed.clear()
