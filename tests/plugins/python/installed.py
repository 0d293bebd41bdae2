#!/usr/bin/env python3
"""The package where make install puts it, and the README's program against it."""
import glob
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

import package

MAKE = {k: v for k, v in os.environ.items()
        if k not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL", "LD_PRELOAD")}


class Installed(unittest.TestCase):
    def setUp(self):
        self.root = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.root)

    def make(self, *arguments):
        done = subprocess.run(["make", "-s", "-C", package.BUILD, "DESTDIR=" + self.root,
                               "libdir=/some/lib", "pythondir=/some/python"] + list(arguments),
                              env=MAKE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout.decode())

    def test_install_and_uninstall(self):
        # The parts of "make install" that are the package's; tests/install does the whole.
        self.make("install-pkgpythonPYTHON", "install-pkgpythonDATA", "install-python-place")
        folder = os.path.join(self.root, "some", "python", "softshadow")
        source = os.path.join(package.PACKAGE, "softshadow", "*")
        wanted = {os.path.basename(path) for path in glob.glob(source)} - {"__pycache__"}
        self.assertEqual(set(os.listdir(folder)) - {"__pycache__"}, wanted | {"_installed.py"})
        with open(os.path.join(folder, "_installed.py")) as file:
            self.assertIn('LIBDIR = "/some/lib"', file.read())
        status, out, err = package.child(
            "import softshadow; print(softshadow.__file__)", PYTHONPATH=os.path.dirname(folder),
            LD_LIBRARY_PATH=os.path.dirname(package.LIBRARY))
        self.assertEqual((status, out.strip(), err), (0, os.path.join(folder, "__init__.py"), ""))
        self.make("uninstall-pkgpythonPYTHON", "uninstall-pkgpythonDATA", "uninstall-python-place")
        self.assertFalse(os.path.exists(folder))

    def test_picture(self):
        picture = os.path.join(self.root, "ground.png")
        program = os.path.join(package.PACKAGE, "ground.py")
        done = subprocess.run([sys.executable, program, picture, "48"], stdout=subprocess.PIPE,
                              check=True, env=dict(os.environ, PYTHONPATH=package.PACKAGE),
                              timeout=120)
        self.assertRegex(done.stdout.decode(), "2304 points, [1-9][0-9]+ of them in penumbra")
        with open(picture, "rb") as file:
            data = file.read()
        start = data.index(b"IDAT")
        length = struct.unpack(">I", data[start - 4:start])[0]
        grey = zlib.decompress(data[start + 4:start + 4 + length])
        self.assertEqual(len(grey), 48 * 49)
        self.assertTrue({0, 255} < set(grey))

    def test_readme(self):
        """Its program runs and prints what stands below it."""
        with open(os.path.join(package.PACKAGE, "README.md")) as file:
            readme = file.read()
        code, shown = re.search(r"```python\n(.*?)```.*?```\n(.*?)```", readme, re.S).groups()
        status, out, err = package.child(code, SOFTSHADOW_LIBRARY=package.LIBRARY)
        self.assertEqual((status, err), (0, ""))
        self.assertEqual(out, shown)


if __name__ == "__main__":
    package.main()
