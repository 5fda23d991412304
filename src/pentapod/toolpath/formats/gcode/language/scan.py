"""What a file uses, seen before it is read: rotary axes, tool changes, LinuxCNC's switch of kinematics."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.formats.gcode.language.vocabulary import Dialect
from pentapod.toolpath.formats.rotary import LETTERS, RotaryAxes

_PLAIN_COMMENT = re.compile(r"\([^()]*\)|;.*$")
_SINUMERIK_COMMENT = re.compile(r"\"[^\"]*\"|;.*$")
_TURNED = re.compile(
    r"(?<![A-Z_])([ABC])(?![0-9]*\s*=)\s*[+-]?(?:[0-9.]*[1-9]|#)|"
    r"(?<![A-Z_])([ABC])\s*=\s*(?:[A-Z]+\(\s*)?[+-]?(?:[0-9.]*[1-9]|[A-Z_$][A-Z0-9_$]*+(?!\s*\())"
)
_PRESENT = re.compile(r"(?<![A-Z_])([ABC])\s*(?:[+-]?[0-9.#]|=)")
_CHANGE, _SWITCH = re.compile(r"M0*6(?![0-9])"), re.compile(r"M42[89](?![0-9])")


@dataclass(frozen=True)
class Scan:
    """letters: of the rotary axes that are turned anywhere, and the line of each; named: of those that the file names.

    changes_tools: the file has M6. switches: it has M428 or M429.
    """

    letters: dict[str, int]
    named: frozenset[str]
    changes_tools: bool
    switches: bool

    @classmethod
    def of(cls, lines: Iterable[str], dialect: Dialect) -> Scan:
        """Return what the lines of a file use."""
        comment = _SINUMERIK_COMMENT if dialect.equals else _PLAIN_COMMENT
        letters: dict[str, int] = {}
        named: set[str] = set()
        changes = switches = False
        for number, line in enumerate(lines, start=1):
            text = comment.sub("", line).upper()
            if len(letters) < len(LETTERS) and any(letter in text for letter in LETTERS):
                named.update(_PRESENT.findall(text))
                for match in _TURNED.finditer(text):
                    letters.setdefault(match[1] or match[2], number)
            if "M" in text:
                changes = changes or _CHANGE.search(text) is not None
                switches = switches or _SWITCH.search(text) is not None
        return cls(letters, frozenset(named), changes, switches)

    def machine(self, dialect: Dialect, file: Path, given: RotaryAxes | None) -> RotaryAxes:
        """Return the rotary axes of the file's machine: those that are given, or else the usual ones of its letters.

        Raises ToolpathError where there are several usual ways, or a letter that is turned is not among the given ones.
        """
        if given is None:
            return self._usual(dialect, file)
        missing = next((letter for letter in self.letters if letter not in given.letters), None)
        if missing is not None:
            what = f"{missing} is turned, and rotary_axes does not list it"
            remedy = "list all rotary axes, from the part to the tool"
            raise ToolpathError(what, file=file, line=self.letters[missing], key=missing, remedy=remedy)
        return given

    def _usual(self, dialect: Dialect, file: Path) -> RotaryAxes:
        used = "".join(sorted(self.named))
        if used not in dialect.pairs:
            used = "".join(sorted(self.letters))
        names = dialect.pairs.get(used)
        if names is None or (used == "AB" and self.switches):
            which = "A, B and C" if used == "ABC" else "A and B"
            raise ToolpathError(
                f"rotary axes {which}: which of them carries the other?", file=file,
                line=max(self.letters.values()), key=used[-1],
                remedy='say so in [toolpath], from the part to the tool: rotary_axes = ["table B", "table A"]',
            )  # fmt: skip
        missing = [f"table {letter}" for letter in LETTERS if letter not in used]
        return RotaryAxes.of([*missing, *names] if names == () or names[0].startswith("table") else list(names))

    def begins_with_tcp(self, dialect: Dialect) -> bool:
        """Whether coordinates are those of the tip from the beginning: LinuxCNC's kinematics of five axes."""
        return not dialect.switched and (self.switches or len(self.named) != 1)
