#!/usr/bin/env python3
"""Progress, cancelling, log, the host's scheduler; other Python threads run meanwhile."""
import ctypes
import sys
import threading
import time
import unittest
from array import array
from concurrent.futures import ThreadPoolExecutor

import package
import softshadow
from package import FACES, GROUND, SQUARE, bits, lit_scene
from softshadow import _load

# Enough points for many ranges, few enough rays to be quick.
MANY = array("f", [c for y in range(-50, 50) for x in range(-100, 100)
                   for c in (x / 200.0, y / 100.0, 0.0)])


class Stop(Exception):
    pass


class Progress(unittest.TestCase):
    def test_values(self):
        told = []  # one thread: the last of several may find another one telling, and say nothing
        with lit_scene(softshadow, build=False, threads=1, progress=told.append) as scene:
            scene.build("raytrace", samples=64)
            self.assertEqual(told[-1], 1)
            del told[:]
            scene.visibility(MANY)
            self.assertGreater(len(told), 2)
            self.assertTrue(all(0 <= done <= 1 for done in told))
            self.assertEqual(told, sorted(told))
            self.assertEqual(told[-1], 1)
            after = len(told)
            time.sleep(0.05)
            self.assertEqual(len(told), after)  # never after the call returned

    def test_cancel(self):
        stop = [False]
        with lit_scene(softshadow, "raytrace", samples=64,
                       progress=lambda done: stop[0] and done > 0.1) as scene:
            wanted = bits(scene.visibility(MANY))
            stop[0] = True
            with self.assertRaises(softshadow.CancelledError):
                scene.visibility(MANY)
            stop[0] = False
            self.assertEqual(bits(scene.visibility(MANY)), wanted)

    def test_what_it_raises_comes_out(self):
        for kind in (Stop, KeyboardInterrupt, SystemExit):
            def progress(done):
                raise kind("%s at %g" % (kind.__name__, done))
            with lit_scene(softshadow, build=False, progress=progress) as scene:
                with self.assertRaisesRegex(kind, "at 0$"):
                    scene.build()
                with self.assertRaisesRegex(kind, "at 0$"):  # nothing is left over for later
                    scene.build()
                with self.assertRaises(softshadow.StateError):
                    scene.visibility(GROUND)

    def test_closing_inside(self):
        scene = lit_scene(softshadow, build=False, progress=lambda done: scene.close())
        with self.assertRaisesRegex(softshadow.StateError, "still use this scene"):
            scene.build()
        scene.close()


class Log(unittest.TestCase):
    def test_lines(self):
        lines = []
        with lit_scene(softshadow, log=lambda level, text: lines.append((level, text))) as scene:
            with self.assertRaises(softshadow.ArgumentError) as caught:
                scene.remove_mesh(9)
        self.assertIn((0, str(caught.exception)), lines)

    @unittest.skipUnless(hasattr(sys, "unraisablehook"), "is of Python 3.8")
    def test_what_it_raises_is_told(self):
        def log(level, text):
            raise Stop(text)
        told, usual = [], sys.unraisablehook
        sys.unraisablehook = lambda what: told.append(what.exc_type)
        try:
            with softshadow.Scene(log=log) as scene:
                with self.assertRaises(softshadow.ArgumentError):
                    scene.remove_mesh(9)
        finally:
            sys.unraisablehook = usual
        self.assertEqual(told, [Stop])


class Parallel(unittest.TestCase):
    def test_same_answers(self):
        with lit_scene(softshadow, "raytrace", samples=64) as scene:
            wanted = bits(scene.visibility(MANY))
        ranges = []

        def backwards(count, run):
            for i in reversed(range(count)):
                run(i, i + 1)
            ranges.append(count)

        def pooled(count, run):
            list(pool.map(lambda i: run(i, i + 1), range(count)))
            ranges.append(count)
        with ThreadPoolExecutor(2) as pool:
            for scheduler in (backwards, pooled):
                with lit_scene(softshadow, "raytrace", samples=64, threads=2,
                               parallel=scheduler) as scene:
                    self.assertEqual(bits(scene.visibility(MANY)), wanted)
                self.assertGreater(max(ranges), 1)
                del ranges[:]

    def test_what_it_raises_comes_out(self):
        kept = []

        def breaks(count, run):
            kept.append(run)
            run(0, 1)
            raise Stop("now")
        with lit_scene(softshadow, build=False, threads=2, parallel=breaks) as scene:
            with self.assertRaisesRegex(Stop, "now"):
                scene.build("raytrace", samples=64)
                scene.visibility(MANY)
            with self.assertRaisesRegex(softshadow.StateError, "after the scheduler had returned"):
                kept[0](0, 1)

    def test_returning_too_early_waits(self):
        """Work that is still running when the scheduler returns is waited for."""
        def careless(count, run):
            thread = threading.Thread(target=run, args=(0, count))
            threads.append(thread)
            thread.start()
            time.sleep(0.01)
        threads = []
        with lit_scene(softshadow, "raytrace", samples=64, threads=2) as scene:
            wanted = bits(scene.visibility(MANY))
        with lit_scene(softshadow, "raytrace", samples=64, threads=2, parallel=careless) as scene:
            try:
                self.assertEqual(bits(scene.visibility(MANY)), wanted)
            except softshadow.InternalError:
                pass  # a thread that came only after the return, on a busy machine, found it closed
        for thread in threads:
            thread.join()


class Lock(unittest.TestCase):
    """Another Python thread counts while a query runs. With the interpreter's lock held it cannot:
    the same query through PyDLL, which holds it, shows that the test would tell."""

    def counted_during(self, library, scene):
        entry = library.softshadow_query_visibility
        entry.restype, entry.argtypes = ctypes.c_int32, [ctypes.c_void_p] * 3
        batch = softshadow._scene._Batch(MANY, None, None, None, None, 0)
        _, held = batch.output(None)
        count, stop = [0], threading.Event()

        def work():
            while not stop.is_set():
                count[0] += 1
                time.sleep(0)
        thread = threading.Thread(target=work)
        thread.start()
        while count[0] < 10:
            time.sleep(0.001)
        begin = time.perf_counter()
        before = count[0]
        status = entry(scene._handle, ctypes.addressof(batch.struct), held.address)
        after, seconds = count[0], time.perf_counter() - begin
        stop.set()
        thread.join()
        self.assertEqual(status, 0)
        return after - before, seconds

    def test_others_run(self):
        with lit_scene(softshadow, build=False, threads=1) as scene:
            scene.build("raytrace", samples=2048)
            released, seconds = self.counted_during(ctypes.CDLL(package.LIBRARY), scene)
            held, _ = self.counted_during(ctypes.PyDLL(package.LIBRARY), scene)
        print("counted %d while a query of %.2f s ran, %d with the lock held"
              % (released, seconds, held))
        self.assertIsInstance(_load.library, ctypes.CDLL)
        self.assertNotIsInstance(_load.library, ctypes.PyDLL)
        # A thread that got the processor at all counts hundreds in that time; the lock lets through
        # what comes between two lines of Python before and after the call.
        self.assertGreater(released, 100)
        self.assertGreater(released, 10 * held)

    def test_changing_while_asked(self):
        """A change while another thread asks is refused, and the question is answered."""
        inside, go_on = threading.Event(), threading.Event()

        def progress(done):
            inside.set()
            go_on.wait(20)
        with lit_scene(softshadow, build=False, progress=progress) as scene:
            go_on.set()
            scene.build("raytrace")
            inside.clear(), go_on.clear()
            answers = []
            thread = threading.Thread(target=lambda: answers.append(scene.visibility(GROUND)))
            thread.start()
            self.assertTrue(inside.wait(20))
            for change in (scene.build, scene.close, lambda: scene.remove_mesh(0),
                           lambda: scene.add_mesh(SQUARE, FACES)):
                with self.assertRaises(softshadow.StateError):
                    change()
            go_on.set()
            thread.join()
            self.assertEqual(len(answers[0]), len(GROUND))


if __name__ == "__main__":
    package.main()
