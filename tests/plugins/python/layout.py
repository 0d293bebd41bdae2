#!/usr/bin/env python3
"""The package's picture of the ABI is the C compiler's: structs, constants, functions."""
import ctypes
import os
import re
import subprocess
import tempfile
import unittest

import package
from softshadow import _abi

C_TYPES = {"uint32_t": ctypes.c_uint32, "softshadow_status": ctypes.c_int32, "void": None,
           "const char *": ctypes.c_char_p, "softshadow *": ctypes.c_void_p,
           "const softshadow *": ctypes.c_void_p, "float *": ctypes.c_void_p,
           "softshadow **": ctypes.POINTER(ctypes.c_void_p),
           "uint32_t *": ctypes.POINTER(ctypes.c_uint32)}
for _struct in _abi.STRUCTS:
    for _const in ("", "const "):
        C_TYPES["%s%s *" % (_const, _struct.__name__)] = ctypes.POINTER(_struct)

CONSTANTS = {"SOFTSHADOW_" + name: getattr(_abi, name)
             for name in ("F32", "F64", "CASTS", "RECEIVES", "BORROW", "NO_PRIMITIVE",
                          "VERSION_MAJOR")}
CONSTANTS.update({name: status for status, name in _abi.STATUS.items()})
for _prefix, _names in (("", _abi.LIGHTS), ("", _abi.BACKENDS), ("", _abi.WEIGHTINGS),
                        ("FALLOFF_", _abi.FALLOFFS), ("BOUND_", _abi.BOUNDS)):
    CONSTANTS.update({"SOFTSHADOW_" + _prefix + name.upper(): number
                      for number, name in enumerate(_names)})


def read(*path):
    with open(os.path.join(package.SOURCE, *path)) as file:
        return file.read()


HEADER = re.sub(r"/\*.*?\*/", "", read("lib", "softshadow.h"), flags=re.S)


def compiled(lines):
    """What a C program with these printf arguments prints, one number a line."""
    body = "".join("    printf(\"%%lld\\n\", (long long)(%s));\n" % line for line in lines)
    with tempfile.TemporaryDirectory() as folder:
        source, program = os.path.join(folder, "a.c"), os.path.join(folder, "a")
        with open(source, "w") as file:
            file.write("#include <softshadow.h>\n#include <stdio.h>\nint main(void) {\n%s"
                       "    return 0;\n}\n" % body)
        include = "-I" + os.path.join(package.SOURCE, "lib")
        environment = {k: v for k, v in os.environ.items() if k != "LD_PRELOAD"}
        subprocess.run(package.CC + [include, "-o", program, source], check=True, env=environment)
        out = subprocess.run([program], stdout=subprocess.PIPE, check=True, env=environment).stdout
    return [int(number) for number in out.split()]


class Layout(unittest.TestCase):
    def test_structs(self):
        asked, ours = [], []
        for struct in _abi.STRUCTS:
            name = struct.__name__
            asked.append("sizeof(%s)" % name)
            ours.append(ctypes.sizeof(struct))
            for field in (field[0] for field in struct._fields_):
                asked += ["offsetof(%s, %s)" % (name, field),
                          "sizeof ((%s *)0)->%s" % (name, field)]
                ours += [getattr(struct, field).offset, getattr(struct, field).size]
        for line, mine, theirs in zip(asked, ours, compiled(asked)):
            self.assertEqual(mine, theirs, line)
        self.assertGreater(len(asked), 200)

    def test_no_struct_or_field_is_missing(self):
        found = {}
        for body, name in re.findall(r"typedef struct \w+ \{(.*?)\n\} (\w+);", HEADER, re.S):
            body = re.sub(r"\(\*(\w+)\)\([^;]*;", r"\1;", body)  # a callback's own name
            names = [re.sub(r"\[.*?\]", "", part).split()[-1].lstrip("*")
                     for line in body.split(";") if line.strip() for part in line.split(",")]
            found[name] = names
        ours = {struct.__name__: [field[0] for field in struct._fields_] for struct in _abi.STRUCTS}
        self.assertEqual(ours, found)

    def test_constants(self):
        names = sorted(CONSTANTS)
        for name, value in zip(names, compiled(names)):
            self.assertEqual(CONSTANTS[name] % 2**64, value % 2**64, name)
        in_enums = set(re.findall(r"SOFTSHADOW_\w+", " ".join(re.findall(r"enum \{(.*?)\}", HEADER,
                                                                      re.S))))
        self.assertEqual(in_enums - set(CONSTANTS), set())

    def test_functions(self):
        exported = set(re.findall(r"^ *(softshadow_\w+);$", read("lib", "softshadow.map"), re.M))
        self.assertEqual(set(_abi.FUNCTIONS), exported)
        declared = re.findall(r"SOFTSHADOW_API ([\w ]+?[ *])(softshadow_\w+)\(([^)]*)\);", HEADER)
        self.assertEqual({name for _, name, _ in declared}, exported)
        for result, name, arguments in declared:
            with self.subTest(name):
                kinds = [re.sub(r"\s+", " ", re.sub(r"\w+$", "", part.strip())).strip()
                         for part in arguments.split(",") if arguments != "void"]
                ours = _abi.FUNCTIONS[name]
                self.assertEqual(ours[0], C_TYPES[result.strip()])
                self.assertEqual(ours[1], [C_TYPES[kind] for kind in kinds])

    def test_every_function_is_used(self):
        folder = os.path.join(package.PACKAGE, "softshadow")
        code = "".join(read(folder, name) for name in os.listdir(folder)
                       if name.endswith(".py") and name != "_abi.py")
        for name in _abi.FUNCTIONS:
            self.assertRegex(code, r"library\.%s\b" % name)

    def test_every_file_is_installed(self):
        listed = set(re.findall(r"%D%/softshadow/(\S+)", read("plugins", "python", "local.mk")))
        there = set(os.listdir(os.path.join(package.PACKAGE, "softshadow"))) - {"__pycache__"}
        self.assertEqual(listed, there)


if __name__ == "__main__":
    package.main()
