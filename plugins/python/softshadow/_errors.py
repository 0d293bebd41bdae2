"""One exception for each status of the library."""
from __future__ import annotations

from typing import Any, Dict, Type

from . import _abi
from ._load import library


class Error(Exception):
    """Whatever the library refuses. str() is its own message: what, where, what is allowed.

    status  the number of the status, such as -1
    name    its name in C, such as "SOFTSHADOW_E_ARGUMENT"
    """

    status = 0
    name = ""


class ArgumentError(Error, ValueError):
    """An argument is not allowed; the message names it. Wrong shapes and types are this, too."""

    status = -1


class StateError(Error, RuntimeError):
    """Not now: nothing is built, the scene is in use or closed, or it was made before fork()."""

    status = -2


class MeshError(Error, ValueError):
    """A vertex or an index cannot be used; the message has its number."""

    status = -3


class LightError(Error, ValueError):
    """A light that is none: NaN, negative radius, skewed axes."""

    status = -4


class OutOfMemoryError(Error, MemoryError):
    """Memory ran out; the scene is as it was."""

    status = -5


class UnsupportedError(Error, NotImplementedError):
    """This build of the library, this machine or this method cannot do it."""

    status = -6


class CancelledError(Error):
    """The progress callback said stop."""

    status = -7


class BackendError(Error, RuntimeError):
    """Embree, EGL or a driver failed; the message has its words."""

    status = -8


class InternalError(Error, RuntimeError):
    """A defect of the library: please report the message."""

    status = -9


BY_STATUS: Dict[int, Type[Error]] = {
    kind.status: kind for kind in (ArgumentError, StateError, MeshError, LightError,
                                   OutOfMemoryError, UnsupportedError, CancelledError, BackendError,
                                   InternalError)}
for _status, _kind in BY_STATUS.items():
    _kind.name = _abi.text(library.softshadow_status_name(_status))


def error_of(status: int, handle: Any) -> Error:
    """The exception for a status that the calling thread just got; handle None: of a create."""
    name = _abi.text(library.softshadow_status_name(status))
    message = _abi.text(library.softshadow_last_message(handle)) or name
    error = BY_STATUS.get(status, Error)(message)
    error.status, error.name = status, name
    return error
