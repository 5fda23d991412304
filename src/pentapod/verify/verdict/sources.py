"""Sources: the files that a verdict is about, by their bytes."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.values import Value


@dataclass(frozen=True)
class Sources(Value):
    """SHA-256 of each file that a verdict is about, as hex digits; None where there is none, or nobody told.

    machine: of the machine's file, also where it is one that ships. fixture: of its mesh. toolpath_file and
    toolpath_curve: what the job's [toolpath] names (a drawing, points, a picture, a toolpath; a guide curve).
    """

    program: str | None = None
    job: str | None = None
    machine: str | None = None
    mesh: str | None = None
    fixture: str | None = None
    stock: str | None = None
    toolpath_file: str | None = None
    toolpath_curve: str | None = None


UNTOLD = Sources()
"""Of what no file is known."""
