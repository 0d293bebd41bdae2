# SPDX-License-Identifier: Apache-2.0
"""Finds the Python package that is bundled with this add-on, and through it the library."""
import importlib
import os

import bpy

VARIABLE = "SOFTSHADOW_LIBRARY"

_failed = {}  # what was tried -> why it failed: a panel asks at every redraw
_loaded = []  # what was wanted when the library was loaded, which happens once


def _chosen():
    addon = bpy.context.preferences.addons.get(__package__)
    path = addon.preferences.library if addon and addon.preferences else ""
    return bpy.path.abspath(path) if path else ""


def load():
    """(the package softshadow, "") or (None, why not). The variable goes before the preference,
    as it does before everything else."""
    given = os.environ.get(VARIABLE)
    wanted = given or _chosen()
    if wanted in _failed:
        return None, _failed[wanted]
    if wanted and not given:
        os.environ[VARIABLE] = wanted
    try:
        package = importlib.import_module(".softshadow", __package__)
        if not _loaded:
            _loaded.append(wanted)
        return package, ""
    except ImportError as error:
        _failed[wanted] = str(error)
        return None, str(error)
    finally:
        if wanted and not given:
            del os.environ[VARIABLE]


def pending():
    """Whether a library is loaded and another is named now: a process keeps its first."""
    return bool(_loaded) and _loaded[0] != (os.environ.get(VARIABLE) or _chosen())


def retry(_preferences, _context):
    """Forgets what failed: the library may be there by now."""
    _failed.clear()
