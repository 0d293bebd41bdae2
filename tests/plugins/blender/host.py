"""Runs a test file inside Blender, the add-on installed from the archive that make install makes.

A test file is run twice: by Python, which starts Blender on it, and in there, where bpy can be
imported and its cases run.
"""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = os.path.abspath(os.environ.get("top_srcdir") or os.path.join(
    os.path.dirname(os.path.abspath(__file__)), "..", "..", ".."))
BUILD = os.path.abspath(os.environ.get("top_builddir") or ".")
ADDON = "softshadow_blender"
SKIP = 77


def blender():
    """The command to run, or None."""
    return os.environ.get("BLENDER") or shutil.which("blender")


def skip(why):
    print(why)
    sys.exit(SKIP)


def check_host(*programs):
    if not blender():
        skip("blender is not there (Debian package blender)")
    for program in programs:
        if not shutil.which(program):
            skip("%s is not there (Debian package %s)" % (program, program.lower()))
    if os.environ.get("SANITIZERS"):
        skip("a sanitized library cannot be loaded by a host that is not")


class Place:
    """A user's folders of its own, and the archive."""

    def __init__(self):
        self.root = tempfile.mkdtemp(prefix="softshadow-blender-")
        clean = {k: v for k, v in os.environ.items()
                 if k not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL", "SOFTSHADOW_LIBRARY")}
        made = subprocess.run(
            ["make", "-s", "-C", BUILD, "install-blender", "DESTDIR=" + self.root,
             "libdir=" + os.path.join(BUILD, ".libs"), "datadir=/share"], env=clean, timeout=120,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if made.returncode:
            sys.exit(made.stdout.decode())
        # Blender takes the Python that PATH names first for its own, and then finds no numpy in it.
        self.environment = dict(
            clean, PATH="/usr/local/bin:/usr/bin:/bin", SOFTSHADOW_ARCHIVE=os.path.join(self.root, "share", "softshadow",
                                                   "softshadow-blender.zip"),
            PYTHONPATH=os.path.dirname(os.path.abspath(__file__)))
        for name in ("SCRIPTS", "CONFIG", "DATAFILES"):
            folder = os.path.join(self.root, name)
            os.mkdir(folder)
            self.environment["BLENDER_USER_" + name] = folder

    def __enter__(self):
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.root)


def run(file, *arguments, **environment):
    """The exit status of the file's cases in Blender without a window."""
    with Place() as place:
        return subprocess.run(
            [blender(), "-b", "--factory-startup", "--python-exit-code", "1", "--python",
             os.path.abspath(file), "--"] + list(arguments),
            env=dict(place.environment, **environment), timeout=540).returncode


def run_in_window(file):
    """The exit status of a file that drives a window, on a virtual screen."""
    read, write = os.pipe()
    screen = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24"],
                              pass_fds=[write], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL)
    try:
        os.close(write)
        with os.fdopen(read) as numbers:
            display = ":" + numbers.readline().strip()
        with Place() as place:
            done = subprocess.run(
                [blender(), "--factory-startup", "--enable-event-simulate", "-p", "0", "0", "800",
                 "600", "--python-exit-code", "1", "--python", os.path.abspath(file)],
                env=dict(place.environment, DISPLAY=display, LIBGL_ALWAYS_SOFTWARE="1"),
                timeout=300, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    finally:
        screen.terminate()
        screen.wait()
    said = done.stdout.decode()
    print(said)
    if "Traceback" in said:  # what goes wrong in a panel or a modal operator ends there only
        return 1
    return done.returncode


# ---- inside Blender ----

def enable():
    """As a user does: Preferences, Add-ons, Install."""
    import bpy
    bpy.ops.preferences.addon_install(filepath=os.environ["SOFTSHADOW_ARCHIVE"])
    bpy.ops.preferences.addon_enable(module=ADDON)


def main():
    enable()
    cases = unittest.defaultTestLoader.loadTestsFromModule(sys.modules["__main__"])
    if not unittest.TextTestRunner(stream=sys.stdout, verbosity=2).run(cases).wasSuccessful():
        raise SystemExit(1)
