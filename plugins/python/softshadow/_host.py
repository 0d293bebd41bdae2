"""Callbacks: Python functions as the library calls them.

Nothing here knows the Scene, so that a scene nobody uses goes at once, not at the next collection.
"""
from __future__ import annotations

import threading
from typing import Any, Callable, List, Optional

from . import _abi
from ._errors import StateError

LogFunction = Callable[[int, str], Any]
ProgressFunction = Callable[[float], Any]
ParallelFunction = Callable[[int, Callable[[int, int], None]], Any]


def _log(function: LogFunction) -> Any:
    def call(user: Any, level: int, text: bytes) -> None:
        function(level, _abi.text(text))
    return _abi.Log(call)


def _progress(function: ProgressFunction, raised: List[BaseException]) -> Any:
    def call(user: Any, done: float) -> int:
        try:
            return 1 if function(done) else 0
        except BaseException as error:  # KeyboardInterrupt, too, must reach who called
            raised.append(error)
            return 1
    return _abi.Progress(call)


class _Range:
    """The body that a scheduler runs. Its memory is the library's and goes when the scheduler
    returns: nobody may be in it then, and nobody may come in later."""

    def __init__(self, body: Any, context: Any) -> None:
        self._body, self._context = body, context
        self._change = threading.Condition()
        self._inside, self._open = 0, True

    def run(self, begin: int, end: int) -> None:
        with self._change:
            if not self._open:
                raise StateError("parallel: run() was called after the scheduler had returned")
            self._inside += 1
        try:
            self._body(self._context, begin, end)
        finally:
            with self._change:
                self._inside -= 1
                self._change.notify_all()

    def close(self, raised: List[BaseException]) -> None:
        done = False
        while not done:
            try:
                with self._change:
                    self._open = False
                    while self._inside:
                        self._change.wait()
                done = True
            except BaseException as error:  # Ctrl-C while waiting: wait on, tell later
                raised.append(error)


def _parallel(function: ParallelFunction, raised: List[BaseException]) -> Any:
    def call(user: Any, count: int, body: Any, context: Any) -> None:
        work = _Range(body, context)
        try:
            function(count, work.run)
        except BaseException as error:
            raised.append(error)
        finally:
            work.close(raised)
    return _abi.Parallel(call)


class Host:
    """The options of a handle, and what its callbacks raised on the way."""

    def __init__(self, threads: int, log: Optional[LogFunction],
                 progress: Optional[ProgressFunction],
                 parallel: Optional[ParallelFunction]) -> None:
        self.raised: List[BaseException] = []
        self.options = _abi.sized(_abi.softshadow_options)
        self.options.threads = threads
        if log is not None:
            self.options.log = _log(log)
        if progress is not None:
            self.options.progress = _progress(progress, self.raised)
        if parallel is not None:
            self.options.parallel = _parallel(parallel, self.raised)
