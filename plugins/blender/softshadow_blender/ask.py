# SPDX-License-Identifier: Apache-2.0
"""Puts a gathered scene and its questions to the library. No bpy in here: it runs in a thread."""
import threading

import numpy

from . import lights

BUILD = 0.3  # share of the progress bar; what it really takes depends on the method


class Cancelled(Exception):
    pass


class Job:
    """Work beside the main thread: its progress, its end, and a way to stop it."""

    def __init__(self, work):
        self.done, self.result, self.error = 0.0, None, None
        self._work, self._stop, self._span = work, threading.Event(), (0.0, 1.0)
        self._thread = threading.Thread(target=self.run, daemon=True)

    def start(self):
        self._thread.start()

    def running(self):
        return self._thread.is_alive()

    def cancel(self):
        self._stop.set()

    def cancelled(self):
        return isinstance(self.error, Cancelled)

    def run(self):
        try:
            self.result = self._work(self)
        except Exception as error:
            # whatever went wrong after the user had enough of it is of no interest any more
            self.error = Cancelled() if self._stop.is_set() else error

    def span(self, begin, end):
        """What comes next moves the bar from begin to end."""
        self._span = begin, end

    def progress(self, done):
        """For the library's callback: any thread, and nothing of Blender is touched."""
        begin, end = self._span
        self.done = begin + (end - begin) * done
        return self._stop.is_set()

    def check(self):
        if self._stop.is_set():
            raise Cancelled()


class Questions:
    """A scene of the library, built for some lamps."""

    def __init__(self, package, world, lamps, settings, job):
        self.package, self.job, self.lamps = package, job, lamps
        self.scene = package.Scene(progress=job.progress)
        job.span(0, BUILD)
        self.ids = {}
        for placed in world.placed:
            job.check()
            shape = placed.shape
            self.ids[placed] = self.scene.add_mesh(
                shape.positions, shape.triangles, transform=placed.matrix.ravel(), borrow=True,
                casts=placed.casts)
        for lamp in lamps:
            try:
                self.scene.add_light(lights.shape_of(package, lamp, lamp.matrix))
            except package.Error as error:
                raise type(error)("%s: %s" % (lamp.name, error)) from None
        method = None if settings["method"] == "auto" else settings["method"]
        self.scene.build(method, weighting=settings["weighting"], tolerance=settings["tolerance"])

    def primitives(self, placed, triangles):
        """The library's numbers of triangles of one placed mesh; -1: none."""
        none = self.package.NO_PRIMITIVE
        out = numpy.full(len(triangles), none, numpy.uint64)
        known = triangles >= 0
        first = numpy.uint64(self.package.primitive(self.ids[placed], 0))
        out[known] = first + triangles[known].astype(numpy.uint64)
        return out

    def ask(self, points, normals, primitives, step=0, steps=1):
        """Visibility of the lamps, (lamps, points) float32; step of steps is for the bar."""
        out = numpy.empty((len(self.lamps), len(points)), numpy.float32)
        parts = steps * len(self.lamps)
        for n in range(len(self.lamps)):
            self.job.check()
            begin = BUILD + (1 - BUILD) * (step * len(self.lamps) + n) / parts
            self.job.span(begin, begin + (1 - BUILD) / parts)
            self.scene.visibility(points, normals=normals, primitives=primitives, light=n,
                                  out=out[n])
        bad = int(numpy.isnan(out).sum())
        if bad:
            raise ValueError("%d points are too far out, must be within +-1e15" % bad)
        return out
