"""What phimvs raises, by cause. Every message names the image, file or stage at fault and says what to do."""

from __future__ import annotations

import re


class Error(RuntimeError):
    """Of phimvs. `image`, `file` and `stage` are what the message names, or None."""

    def __init__(self, message: str = "") -> None:
        super().__init__(message)
        found = re.search(r"\bimage (\S+?): ", message)
        self.image: str | None = found.group(1) if found else None
        found = re.search(r"(/[^:\n]*): ", message)
        self.file: str | None = found.group(1) if found else None
        found = re.match(r"(fusion|plane inference|estimation|filter|evaluate|report)\b", message)
        self.stage: str | None = found.group(1) if found else None


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
