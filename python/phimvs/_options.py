"""What the generated options are made of."""

from __future__ import annotations

import difflib
from typing import Any

from . import _core
from ._run import text_of
from .errors import UsageError


class Option:
    """An attribute whose values the command checks when they are assigned."""

    def __init__(self, name: str, default: Any, help: str) -> None:
        self.name, self.default, self.__doc__ = name, default, help

    def __get__(self, owner: Any, kind: Any = None) -> Any:
        return self if owner is None else owner._values.get(self.name, self.default)

    def __set__(self, owner: Any, value: Any) -> None:
        _core.describe_command(owner._command, [f"--{self.name}", text_of(value)])
        owner._values[self.name] = value


class Group:
    """The options whose names begin alike. Attributes that are none are refused."""

    def __init__(self, command: str, values: dict[str, Any]) -> None:
        object.__setattr__(self, "_command", command)
        object.__setattr__(self, "_values", values)

    def __setattr__(self, name: str, value: Any) -> None:
        names = [n for n, v in vars(type(self)).items() if isinstance(v, Option)]
        if name not in names:
            near = difflib.get_close_matches(name, names, 1)
            raise UsageError(f"{type(self).__name__} has no option {name!r}" + (f"; did you mean {near[0]!r}?" if near else ""))
        object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._values})"


class GroupOf:
    def __init__(self, kind: type[Group]) -> None:
        self._kind = kind

    def __get__(self, owner: Any, kind: Any = None) -> Any:
        return self._kind if owner is None else self._kind(owner._command, owner._values)


class CommandOptions(Group):
    """All options of a command. Values may be given by the command line's names:
    PatchMatchStereoOptions(**{"PatchMatchStereo.max_image_size": 1000})."""

    _command = ""

    def __init__(self, **values: Any) -> None:
        super().__init__(self._command, {})
        _core.describe_command(self._command, [w for n, v in values.items() for w in (f"--{n}", text_of(v))])
        self._values.update(values)

    def __copy__(self) -> CommandOptions:
        """Of its own: what is set in a copy is not set here."""
        copied = type(self)()
        copied._values.update(self._values)
        return copied

    def changed(self) -> dict[str, Any]:
        """The values that were given, by the command line's names."""
        return dict(self._values)
