"""Arrays of all kinds, in and out, copied only where the library could not read them in place.

In: whatever has the buffer protocol (numpy, array.array, memoryview, ctypes arrays, bytes) and
sequences of numbers. Out: numpy arrays if numpy can be imported, else array.array.
"""
from __future__ import annotations

import ctypes
import functools
import operator
import sys
from array import array
from typing import Any, List, Optional, Sequence, Tuple

from ._errors import ArgumentError

# Element kinds by name: code of array.array, numpy's dtype.
KINDS = {"float32": "f", "float64": "d", "uint32": "I", "int32": "i", "uint64": "Q", "int64": "q",
         "uint8": "B"}
_NATIVE = "@=<" if sys.byteorder == "little" else "@=>!"
_RECORDS_RO = 0x1C  # PyBUF_RECORDS_RO: shape, strides and format of a buffer that is only read


class _PyBuffer(ctypes.Structure):
    """Py_buffer of CPython's stable ABI. Needed for one thing: the address of read-only memory,
    which neither memoryview nor ctypes tells."""
    _fields_ = [("buf", ctypes.c_void_p), ("obj", ctypes.c_void_p), ("len", ctypes.c_ssize_t),
                ("itemsize", ctypes.c_ssize_t), ("readonly", ctypes.c_int), ("ndim", ctypes.c_int),
                ("format", ctypes.c_char_p), ("shape", ctypes.c_void_p),
                ("strides", ctypes.c_void_p), ("suboffsets", ctypes.c_void_p),
                ("internal", ctypes.c_void_p)]


_get = ctypes.pythonapi.PyObject_GetBuffer
_get.argtypes = [ctypes.py_object, ctypes.POINTER(_PyBuffer), ctypes.c_int]
_release = ctypes.pythonapi.PyBuffer_Release
_release.argtypes, _release.restype = [ctypes.POINTER(_PyBuffer)], None


def _address(view: memoryview) -> int:
    """Where the memory of a view begins; it stays there as long as the view is held."""
    raw = _PyBuffer()
    _get(view, ctypes.byref(raw), _RECORDS_RO)
    try:
        return raw.buf or 0
    finally:
        _release(ctypes.byref(raw))


@functools.lru_cache(maxsize=None)
def numpy() -> Any:
    """The module, or None where it cannot be imported."""
    try:
        import numpy as module
    except ImportError:
        return None
    return module


class Held:
    """Memory that stays in place: count rows of some columns, stride bytes from row to row.

    shape is that of the array given, less the columns; copied tells whether this is a copy.
    """

    __slots__ = ("address", "end", "count", "stride", "kind", "shape", "copied", "view")

    def __init__(self, view: memoryview, kind: str, shape: Tuple[int, ...], stride: int, row: int,
                 copied: bool) -> None:
        self.view, self.kind, self.shape, self.stride = view, kind, shape, stride
        self.copied = copied
        self.count = functools.reduce(operator.mul, shape, 1)
        self.address = _address(view) if self.count else 0
        self.end = self.address + (self.count - 1) * stride + row if self.count else 0

    def overlaps(self, other: "Held") -> bool:
        return self.address < other.end and other.address < self.end


def _kind_of(view: memoryview) -> str:
    """The kind of a buffer's elements by its format, "" where there is none."""
    code = view.format.lstrip(_NATIVE) if view.format[:1] in _NATIVE else view.format
    if code in ("f", "d"):
        return "float32" if code == "f" else "float64"
    if code in "bhilqn" and len(code) == 1:
        return "int%d" % (8 * view.itemsize)
    if code in "BHILQN" and len(code) == 1:
        return "uint%d" % (8 * view.itemsize)
    return ""


def _shape(view: memoryview) -> Tuple[int, ...]:
    return tuple(view.shape or ())


def _is_raw(value: Any) -> bool:
    """Plain bytes: no numbers of their own, but the memory of some."""
    if isinstance(value, memoryview):
        return value.ndim == 1 and value.format in ("B", "b", "c") and value.contiguous
    return isinstance(value, (bytes, bytearray))


def _flatten(value: Any, name: str, flat: List[Any]) -> Tuple[int, ...]:
    """Appends the numbers of nested sequences, returns the shape."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__"):
        flat.append(value)
        return ()
    inner = [_flatten(item, name, flat) for item in value]
    if any(shape != inner[0] for shape in inner):
        raise ArgumentError("%s: rows of different lengths, must be of one shape" % name)
    return (len(inner),) + (inner[0] if inner else ())


def _convert_plain(value: Any, kind: str, name: str) -> memoryview:
    flat: List[Any] = []
    try:
        shape = _flatten(value.tolist() if isinstance(value, memoryview) else value, name, flat)
        data = memoryview(array(KINDS[kind], flat))
    except (TypeError, OverflowError, NotImplementedError) as error:
        raise ArgumentError("%s: %s; must be convertible to %s" % (name, error, kind)) from None
    return data.cast("B").cast(KINDS[kind], shape) if flat and len(shape) > 1 else data


def _convert_numpy(value: Any, kind: str, name: str) -> memoryview:
    np = numpy()
    try:
        given = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise ArgumentError("%s: %s" % (name, error)) from None
    whole_numbers = not kind.startswith("float")
    if given.size and given.dtype.kind not in ("biu" if whole_numbers else "biuf"):
        raise ArgumentError("%s: elements are %s, must be convertible to %s"
                            % (name, given.dtype, kind))
    if given.size and whole_numbers:
        limits = np.iinfo(kind)
        if int(given.min()) < limits.min or int(given.max()) > limits.max:
            raise ArgumentError("%s: %d..%d, must be within %d..%d" % (
                name, given.min(), given.max(), limits.min, limits.max))
    with np.errstate(over="ignore"):
        return memoryview(np.array(given, dtype=kind, order="C"))


def _convert(value: Any, kind: str, name: str) -> memoryview:
    """A packed copy with elements of that kind. numpy would make doubles of a list that mixes
    NO_PRIMITIVE with small numbers: lists of whole numbers go the plain way."""
    is_array = isinstance(value, memoryview) or hasattr(value, "__array__")
    by_numpy = numpy() and (is_array or kind.startswith("float"))
    return (_convert_numpy if by_numpy else _convert_plain)(value, kind, name)


def _open(value: Any) -> Optional[memoryview]:
    try:
        view = memoryview(value)
    except (TypeError, ValueError, BufferError):
        return None
    return None if view.suboffsets else view


def _open_raw(value: Any, kind: str, columns: int, name: str) -> memoryview:
    view = memoryview(value).cast("B")
    row = columns * array(KINDS[kind]).itemsize
    if view.nbytes % row:
        raise ArgumentError("%s: %d bytes, must be a multiple of %d (%s x %d)"
                            % (name, view.nbytes, row, kind, columns))
    return view.cast(KINDS[kind])


def _split(view: memoryview, columns: int, name: str) -> Tuple[int, ...]:
    """The shape less the columns. A flat array of numbers is rows one after another."""
    shape = _shape(view)
    if columns == 1:
        return shape
    if len(shape) == 1 and shape[0] % columns == 0:
        return (shape[0] // columns,)
    if len(shape) > 1 and shape[-1] == columns:
        return shape[:-1]
    raise ArgumentError("%s: shape %s, must be (N, %d)" % (name, shape, columns))


def _row_stride(view: memoryview, columns: int) -> int:
    """Bytes from row to row, 0 where rows are not evenly spaced, in order and apart."""
    if view.c_contiguous:
        return columns * view.itemsize
    shape, strides = list(_shape(view)), list(view.strides or ())
    if columns > 1:
        if len(shape) == 1 or strides[-1] != view.itemsize:
            return 0
        shape.pop(), strides.pop()
    rows = [(n, step) for n, step in zip(shape, strides) if n > 1]
    for (_, outer), (n, inner) in zip(rows, rows[1:]):
        if outer != n * inner:
            return 0
    stride = rows[-1][1] if rows else columns * view.itemsize
    return stride if stride >= columns * view.itemsize else 0


def hold(value: Any, name: str, columns: int, kinds: Sequence[str], packed: bool = False,
         raw: str = "") -> Held:
    """Holds an array whose rows have that many columns.

    kinds   what the library reads; anything else is converted to the first
    packed  whether the library wants rows without gaps
    raw     what plain bytes are made of; the first kind if empty
    """
    if _is_raw(value):
        value = _open_raw(value, raw or kinds[0], columns, name)
    view = _open(value)
    kind = _kind_of(view) if view is not None else ""
    copied = kind not in kinds
    if view is None or copied:
        kind = kinds[0]
        view = _convert(value if view is None else view, kind, name)
    shape = _split(view, columns, name)
    stride, row = _row_stride(view, columns), columns * view.itemsize
    if view.nbytes and (stride == 0 or (packed and stride != row) or
                        _address(view) % view.itemsize):
        view, stride, copied = _convert(view, kind, name), row, True
    return Held(view, kind, shape, stride, row, copied)


def hold_output(value: Any, name: str, count: int) -> Held:
    """Holds a caller's array for count float32 results: writable, packed, and no copy."""
    view = _open(value)
    if view is None or _kind_of(view) != "float32" or not view.c_contiguous or view.readonly:
        raise ArgumentError("%s: must be writable, packed float32" % name)
    held = Held(view, "float32", _shape(view), view.itemsize, view.itemsize, False)
    if held.count != count:
        raise ArgumentError("%s: shape %s, must hold %d numbers" % (name, held.shape, count))
    return held


def new_output(kind: str, shape: Tuple[int, ...]) -> Tuple[Any, Held]:
    """A new array (numpy: of that shape; else flat) and its memory."""
    if numpy():
        made = numpy().empty(shape, dtype=kind)
    else:
        code = KINDS[kind]
        count = functools.reduce(operator.mul, shape, 1)
        made = array(code, bytes(count * array(code).itemsize))
    view = memoryview(made)
    return made, Held(view, kind, _shape(view), view.itemsize, view.itemsize, False)


def copy_out(address: int, kind: str, shape: Tuple[int, ...]) -> Any:
    """A new array filled from memory of the library."""
    made, held = new_output(kind, shape)
    if held.count:
        ctypes.memmove(held.address, address, held.count * held.view.itemsize)
    return made


def whole(value: Any, name: str, most: int = 2**32 - 1) -> int:
    """A whole number that fits the field; ctypes alone would wrap it silently."""
    try:
        number = operator.index(value)
    except TypeError:
        raise ArgumentError("%s: %r, must be a whole number" % (name, value)) from None
    if not 0 <= number <= most:
        raise ArgumentError("%s: %d, must be 0..%d" % (name, number, most))
    return number


def real(value: Any, name: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ArgumentError("%s: %r, must be a number" % (name, value)) from None


def reals(value: Any, name: str, *counts: int) -> List[float]:
    """Some numbers, flat or nested; there must be as many as one of counts."""
    flat: List[Any] = []
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__"):
        raise ArgumentError("%s: %r, must be %d numbers" % (name, value, counts[0]))
    try:
        shape = _flatten(value, name, flat)
    except TypeError as error:
        raise ArgumentError("%s: %s" % (name, error)) from None
    if len(flat) not in counts:
        raise ArgumentError("%s: shape %s, must be %s numbers"
                            % (name, shape, " or ".join(map(str, counts))))
    return [real(item, name) for item in flat]


def choice(value: Any, name: str, allowed: Sequence[str]) -> int:
    """The number of one of several names."""
    if value in allowed:
        return allowed.index(value)
    raise ArgumentError("%s: %r, must be one of %s" % (name, value, ", ".join(allowed)))
