"""Registry: plug-ins by name, pentapod's own and those of other packages, found by entry points; names of packages.

Both are imported when they are first used.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pentapod.base.errors import InputError, nearest

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")


@cache
def _entries_of(group: str, path: tuple[str, ...]) -> dict[str, EntryPoint]:
    """Return the entry points of a group by name. path: `sys.path`, the key of the cache."""
    from importlib.metadata import entry_points  # noqa: PLC0415 - a plain command does not read them

    del path
    return {entry.name: entry for entry in entry_points(group=group)}


class Registry(Mapping[str, T], Generic[T]):
    """Things of one kind by name: pentapod's own, then those that installed packages name by entry points.

    kind: word for messages ("post"); group: of the entry points; type_: required type. An entry point names a thing of
    this type, or a function without arguments that returns one. Entry points are read when another name than pentapod's
    own is looked up, or all are listed; a plug-in is imported when it is used. homes: modules of pentapod's own things
    by name, where they do not register themselves; each has its thing as `constant`.
    """

    def __init__(
        self,
        kind: str,
        group: str,
        type_: type[T],
        wrong: type[InputError] = InputError,
        *,
        homes: Mapping[str, str] | None = None,
        constant: str = "",
    ) -> None:
        self.kind, self.group, self._type, self._wrong = kind, group, type_, wrong
        self._own: dict[str, T] = {}
        self._homes, self._constant = dict(homes or {}), constant

    @property
    def own(self) -> Mapping[str, T]:
        """Pentapod's own things; entry points are not read."""
        for name in self._homes:
            self.find(name)
        return self._own

    @property
    def added(self) -> tuple[str, ...]:
        """Names of the things of other packages."""
        return tuple(name for name in self._entries() if name not in self._homes and name not in self._own)

    def register(self, name: str, thing: T) -> T:
        """Add one of pentapod's own, and return it."""
        self._own[name] = thing
        return thing

    def find(self, name: str, key: str | None = None) -> T:
        """Return the thing of this name. Raises InputError: unknown, or it cannot be loaded. key: for the message."""
        if name in self._own:
            return self._own[name]
        if name in self._homes:
            return self.register(name, getattr(import_module(self._homes[name]), self._constant))
        entries = self._entries()
        if name not in entries:
            raise self._wrong(f"unknown {self.kind}", key=key, value=name, remedy=nearest(name, self))
        return self._loaded(entries[name])

    def __getitem__(self, name: str) -> T:
        if name not in self:
            raise KeyError(name)
        return self.find(name)

    def __contains__(self, name: object) -> bool:
        return name in self._homes or name in self._own or name in self._entries()

    def __iter__(self) -> Iterator[str]:
        yield from dict.fromkeys((*self._homes, *self._own))
        yield from self.added

    def __len__(self) -> int:
        return len(tuple(iter(self)))

    def _entries(self) -> dict[str, EntryPoint]:
        return _entries_of(self.group, tuple(sys.path))

    def _loaded(self, entry: EntryPoint) -> T:
        """Return what an entry point names. Raises InputError that names the package."""
        package = f'the package "{entry.dist.name}"' if entry.dist else "its package"
        try:
            thing: Any = entry.load()
            if not isinstance(thing, self._type) and callable(thing):
                thing = thing()
        except Exception as error:
            raise self._wrong(
                f"this {self.kind} cannot be loaded: {type(error).__name__}: {error}", key=entry.name,
                value=entry.value, remedy=f"repair or remove {package}",
            ) from error  # fmt: skip
        if isinstance(thing, self._type):
            return thing
        raise self._wrong(
            f"the entry point names no {self.kind}", key=entry.name, value=entry.value,
            expected=f"a pentapod {self._type.__name__}", remedy=f"repair or remove {package}",
        )  # fmt: skip


def imported_when_used(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of a package whose names are imported when they are first used.

    homes: names, separated by spaces, by the module that they live in, below `pentapod`. No name may be that of a
    module of the package, which would hide it.
    """
    places = {name: f"pentapod.{home}" for home, names in homes.items() for name in names.split()}

    def get(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(places[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return get, lambda: sorted({*vars(sys.modules[package]), *places}), sorted(places)
