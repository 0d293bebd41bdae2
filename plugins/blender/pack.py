#!/usr/bin/env python3
"""Writes the add-on's archive: pack.py ARCHIVE.zip LIBDIR SOURCE FILE...

Files lie below SOURCE. They keep their path from the folder softshadow_blender or softshadow on; the Python package becomes a
part of the add-on, with a note of where the library was installed. The same files give the same bytes.
"""
import os
import sys
import zipfile

ADDON = "softshadow_blender"


def place(path):
    parts = os.path.normpath(path).split(os.sep)
    if ADDON in parts:
        return "/".join(parts[parts.index(ADDON):])
    if "softshadow" in parts:
        return "/".join([ADDON] + parts[parts.index("softshadow"):])
    return ADDON + "/" + parts[-1]


def main(archive, libdir, source, *files):
    texts = {ADDON + "/softshadow/_installed.py":
             ("# Written by make install.\nLIBDIR = %r\n" % libdir).encode()}
    for path in files:
        with open(os.path.join(source, path), "rb") as file:
            texts[place(path)] = file.read()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as out:
        for name in sorted(texts):
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            out.writestr(entry, texts[name])


if __name__ == "__main__":
    main(*sys.argv[1:])
