"""What every call shares: logging, progress, options as the command line's words."""

from __future__ import annotations

import atexit
import logging
import os
import re
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from . import _core
from .errors import Cancelled, InputError, UsageError

logger = logging.getLogger("phimvs")
_LOGGING_DECIDES = ("log_level", "log_timestamps")  # options of the command line
_LEVELS = (logging.ERROR, logging.WARNING, logging.INFO, logging.DEBUG)


class Progress(NamedTuple):
    """What a progress callable is told, about four times a second."""

    stage: str  # what is being done: "estimating"
    done: int  # of the stage, images mostly
    total: int
    fraction: float  # of the whole job, 0 to 1
    seconds: float  # since it began
    seconds_left: float  # < 0: unknown


ProgressCallable = Callable[[Progress], object]


# How the commands begin and end a part of the images: --shard, a job array or a file of settings may have chosen it.
_SHARD_AT_WORK = re.compile(r"\bshard \d+/\d+(:| with )")


class Run:
    """The listeners of one call; keeps the errors and warnings that were logged, and whether it was a shard's."""

    def __init__(self, progress: ProgressCallable | None) -> None:
        self.errors: list[InputError] = []
        self.warnings: list[str] = []
        self.is_shard = False
        self._progress = progress

    @property
    def listeners(self) -> Any:
        """For the compiled part. Not kept here: it refers to this object, and Python could not free such a circle."""
        tell = None if self._progress is None else self._tell
        return _core.Listeners(self._log, tell, logger.isEnabledFor(logging.DEBUG))

    @property
    def image_errors(self) -> list[str]:
        """A sentence for each image that could not be done, without those that sum up."""
        return [str(error) for error in self.errors if error.image]

    def _log(self, level: int, message: str, file: str, image: str, stage: str) -> None:
        if level == 0:
            self.errors.append(InputError(message, file, image, stage))
        elif level == 1:
            self.warnings.append(message)
        elif _SHARD_AT_WORK.search(message):
            self.is_shard = True
        logger.log(_LEVELS[level], "%s", message)

    def _tell(self, *state: Any) -> None:
        assert self._progress is not None
        self._progress(Progress(*state))


class _Calls:
    """Those of the compiled part that are under way, in all threads."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.num = 0
        self.python_ends = False
        self.forked_amid = False

    def begin(self) -> None:
        if self.forked_amid:
            raise UsageError(
                "this process was forked while a phimvs call was under way in another thread, and cannot start one: start "
                "processes before such calls, or by multiprocessing's method 'spawn' or 'forkserver'"
            )
        with self.changed:
            if self.python_ends:
                raise Cancelled("Python ends, and starts no further call")
            self.num += 1

    def end(self) -> None:
        with self.changed:
            self.num -= 1
            self.changed.notify_all()

    def cancel(self) -> None:
        """At Python's end: it would tear a daemon thread out of the compiled part, which aborts the process."""
        give_up = time.monotonic() + _SECONDS_TO_END
        with self.changed:
            self.python_ends = True
            while self.num > 0 and time.monotonic() < give_up:
                _core.cancel()  # again and again: of calls that wait for each other, each is to end
                self.changed.wait(0.1)


_SECONDS_TO_END = 60  # a callable may never return
_calls = _Calls()


def _forget_calls() -> None:
    """In a forked process, which has the forking thread alone."""
    global _calls
    amid = _calls.num > 0 or _calls.forked_amid
    _calls = _Calls()
    _calls.forked_amid = amid


atexit.register(lambda: _calls.cancel())
os.register_at_fork(after_in_child=_forget_calls)


def compute(function: Callable[..., Any], *arguments: Any) -> Any:
    """Of the compiled part, which may take long."""
    calls = _calls  # a callable may fork
    calls.begin()
    try:
        return function(*arguments)
    finally:
        calls.end()


def text_of(value: Any) -> str:
    """As the command line writes it: a list as its elements between commas."""
    if getattr(value, "ndim", None) == 0:  # a scalar of numpy's, which prints as np.float64(0.01)
        value = value.item()
    if isinstance(value, (list, tuple)):
        return ",".join(map(text_of, value))
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    return repr(value) if isinstance(value, float) else str(value)


def words_of(options: Any) -> list[str]:
    """Options as the command line's words: of None, a mapping by the command line's names, or an options object."""
    if options is None:
        return []
    if hasattr(options, "changed"):
        options = options.changed()
    if not isinstance(options, Mapping):
        raise UsageError(
            f"options is a {type(options).__name__}, but must be a phimvs options object or a dict such as "
            "{'PatchMatchStereo.max_image_size': 1000}"
        )
    words: list[str] = []
    for name, value in options.items():
        if name in _LOGGING_DECIDES:
            raise UsageError(f"{name} is for the command line; here logging.getLogger('phimvs') decides what is told")
        words += [f"--{name}", text_of(value)]
    return words
