"""What phimvs raises, by cause. Every message names the image, file or stage at fault and says what to do."""

from __future__ import annotations


class Error(RuntimeError):
    """Of phimvs. What it is about, or None: `file`, with its folder as it was given, `image`, and `stage`, as phimvs.json has it, or
    "fusion", "evaluate" or "report"."""

    def __init__(self, message: str = "", file: str | None = None, image: str | None = None, stage: str | None = None) -> None:
        super().__init__(message)
        self.file = file or None
        self.image = image or None
        self.stage = stage or None


class UsageError(Error, ValueError):
    """An argument or an option is wrong."""


class InputError(Error):
    """A file, an image or a scene is missing, damaged or does not fit the rest."""


class ResourceError(Error):
    """Memory, disk or threads ran out."""


class NoDeviceError(Error):
    """There is no device of the kind that was asked for."""


class RetryLater(Error):
    """A shard needs what other shards have not made yet. What it could make is kept: the same call goes on later."""


class Cancelled(Error):
    """phimvs.cancel() was called."""
