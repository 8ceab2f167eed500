"""What every call shares: logging, progress, options as the command line's words."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from . import _core
from .errors import InputError, UsageError

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
