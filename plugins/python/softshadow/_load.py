"""Finds libsoftshadow.so.1 and refuses what it cannot work with."""
from __future__ import annotations

import ctypes
import ctypes.util
import os
from typing import Iterator, List, Tuple

from . import _abi

SONAME = "libsoftshadow.so.%d" % _abi.VERSION_MAJOR
VARIABLE = "SOFTSHADOW_LIBRARY"


def _places() -> Iterator[Tuple[str, str]]:
    """(why, what to load), in the order tried."""
    chosen = os.environ.get(VARIABLE)
    if chosen:
        # Who names a library wants that one or none.
        yield VARIABLE, chosen
        return
    try:
        from ._installed import LIBDIR  # type: ignore  # written by make install
    except ImportError:
        pass
    else:
        yield "where it was installed", os.path.join(LIBDIR, SONAME)
    yield "the system's search path", SONAME
    found = ctypes.util.find_library("softshadow")
    if found and found != SONAME:
        yield "ctypes.util.find_library", found


def _open(path: str) -> ctypes.CDLL:
    """CDLL, not PyDLL: other Python threads run during every call."""
    library = ctypes.CDLL(path)
    try:
        number = library.softshadow_version
    except AttributeError:
        raise OSError("it is no softshadow library") from None
    number.restype, number.argtypes = _abi.FUNCTIONS["softshadow_version"]
    version = number()
    if version // 10000 != _abi.VERSION_MAJOR:
        raise OSError("it is version %d.%d, this package needs %d.x"
                      % (version // 10000, version // 100 % 100, _abi.VERSION_MAJOR))
    try:
        return _abi.declare(library)
    except AttributeError as error:
        raise OSError(str(error)) from None


def load() -> ctypes.CDLL:
    """The library. Raises ImportError that tells every place where it was looked for."""
    failures: List[str] = []
    for why, path in _places():
        try:
            return _open(path)
        except OSError as error:
            failures.append("%s (%s): %s" % (path, why, error))
    raise ImportError("softshadow: the library was not found; install it, or set %s to %s. Tried %s"
                      % (VARIABLE, SONAME, "; ".join(failures)), name="softshadow")


library = load()
