"""The exceptions of pentapod.

    PentapodError
    └── InputError (also ValueError)     what was given is wrong: the command line exits with 2
        ├── ArrayError                   an array argument: shape, finiteness, range
        ├── MeshError                    a mesh file or its content
        ├── ToolpathError                a toolpath, or the parameters of a strategy
        ├── MachineError                 a machine file or an impossible machine
        ├── JobError                     a job file
        └── ProgramError                 a program file, or one that does not belong to its job

A task that *cannot be done* (a part out of reach, no time law) is not an exception but a value that names the cause:
`pentapod.base.refusal.Refusal`.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from pathlib import Path

LONGEST_NUMBER = 15
"""Characters of a number from which a message rounds it."""

LONGEST_SHOWN = 200
"""Characters of a value that a message shows."""


class PentapodError(Exception):
    """Base of every exception that pentapod raises on purpose.

    >>> issubclass(InputError, PentapodError), issubclass(RefusalError, PentapodError)
    (True, True)
    """


class InputError(PentapodError, ValueError):
    """Bad input; the message is one line that names the place, the value and the remedy.

    what: what is wrong. file, key, line, column: where. value: what was found. All are kept as attributes. others: what
    else is wrong in the same file, where a reader goes on after the first error.

    >>> str(InputError("out of range", key="feed.cut_mm_min", value=-1, expected="a positive number"))
    'feed.cut_mm_min: out of range (got -1); expected a positive number'
    """

    others: tuple[InputError, ...] = ()

    def __init__(
        self,
        what: str,
        *,
        file: str | Path | None = None,
        key: str | None = None,
        line: int | None = None,
        column: int | None = None,
        value: object = None,
        expected: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.what, self.file, self.key = what, file, key
        self.line, self.column, self.value = line, column, value
        self.expected, self.remedy = expected, remedy
        super().__init__(self._message())

    def add_others(self, others: Sequence[InputError]) -> None:
        """Keep further errors of the same file; a traceback shows them as notes."""
        self.others = (*self.others, *others)
        for error in others:
            self.add_note(str(error))

    def _message(self) -> str:
        place = "" if self.file is None else str(self.file)
        if self.line is not None:
            place += f":{self.line}" if place else f"line {self.line}"
            place += "" if self.column is None else f":{self.column}"
        head = ": ".join(part for part in (place, _printable(self.key or ""), self.what) if part)
        if self.value is not None:
            head += f" (got {_shown(self.value)})"
        if self.expected:
            head += f"; expected {self.expected}"
        if self.remedy:
            head += f"; {self.remedy}"
        return head if head.isprintable() else " ".join(_printable(word) for word in head.split())


class ArrayError(InputError):
    """An array argument has the wrong shape, holds NaN or infinity, or is out of range."""


class MeshError(InputError):
    """A mesh file cannot be read, or what it holds is not a surface."""


class ToolpathError(InputError):
    """A toolpath is malformed, or a strategy's parameters make no sense."""


class MachineError(InputError):
    """A machine file is malformed, or describes a machine that cannot exist."""


class JobError(InputError):
    """A job file is malformed, or contradicts itself."""


class ProgramError(InputError):
    """A program file is malformed, or does not belong to the job or machine it is judged against."""


def _shown(value: object) -> str:
    """Return a value for a message, shortened."""
    try:
        text = repr(value)
        if isinstance(value, float) and len(text) > LONGEST_NUMBER:
            text = f"{value:.12g}"  # 1.0000000000000001e-07 is what a conversion of units leaves
    except (ValueError, RecursionError):  # a whole number beyond 4,300 digits, or lists in lists in lists
        return f"{type(value).__name__} too large to show"
    return text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 1] + "…"


def _printable(text: str) -> str:
    """Return a text for a message, shortened and without control characters, which a terminal would execute."""
    text = text if text.isprintable() else ascii(text)[1:-1]
    return text if len(text) <= LONGEST_SHOWN else text[: LONGEST_SHOWN - 1] + "…"


def nearest(name: str, known: Iterable[str]) -> str:
    """Return ``did you mean "…"?`` with the known name closest to `name`, or the list of known names."""
    names = sorted(known)
    longer = [each for each in names if name and each.startswith(f"{name}_")]
    if len(longer) == 1:  # the unit of the key is left out
        return f'did you mean "{longer[0]}"?'
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    return f'did you mean "{close[0]}"?' if close else "known: " + ", ".join(names)
