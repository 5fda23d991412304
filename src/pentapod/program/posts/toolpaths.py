"""Posts of the placed toolpath, machine frame, with the planned axes: APT and RoboDK's CSV."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from pentapod.base.archives import check_array, read_arrays
from pentapod.base.errors import InputError, ProgramError
from pentapod.program.posts.registry import Post, PostInput, register
from pentapod.program.posts.rows import read_file
from pentapod.program.program import Program
from pentapod.toolpath.formats import FORMATS, read_toolpath
from pentapod.toolpath.toolpath import Toolpath

SAME_M = 1e-11
"""Leg lengths are written with this resolution."""


def placed_toolpath(plan: str | Path, program: Program) -> Toolpath:
    """Return the placed toolpath from a run's plan.npz: machine frame, planned axes.

    Raises InputError: not such a file, or of another run than the program.
    """
    file = Path(plan)
    given = read_toolpath(file, "npz")
    forms = {
        "placed.tips_mm": given.tips.shape,
        "placed.axes": given.tips.shape,
        "program.legs_mm": (None, program.legs.shape[1]),
    }
    arrays = read_arrays(file, forms, InputError)
    for name, shape in forms.items():
        check_array(arrays[name], name, file, InputError, "f", shape)
    tips, axes = arrays["placed.tips_mm"] / 1e3, arrays["placed.axes"]
    legs = arrays["program.legs_mm"] / 1e3
    if legs.shape != program.legs.shape or np.abs(legs - program.legs).max() > SAME_M:
        raise ProgramError(
            "the program is not that of this plan", file=file, key="program.legs_mm",
            remedy="give the plan.npz that was written with the program",
        )  # fmt: skip
    bounds = zip(given.segments, given.starts[:-1], given.starts[1:], strict=True)
    placed = (replace(s, tips=tips[a : b + 1], axes=axes[a : b + 1]) for s, a, b in bounds)
    return replace(given, segments=tuple(placed))


def _write(given: PostInput, form: str, file: str) -> dict[str, bytes]:
    return {file: FORMATS[form].write(given.the_toolpath())}


def _read(folder: Path, form: str, file: str) -> Toolpath:
    read_file(folder / file)
    return read_toolpath(folder / file, form)


def _post(form: str, file: str, about: str) -> Post:
    write, read = partial(_write, form=form, file=file), partial(_read, form=form, file=file)
    return register(Post(form, about, write, read, FORMATS[form].loses, takes_toolpath=True))


APT = _post("apt", "placed.apt", "APT, the toolpath as placed, machine frame")
ROBODK = _post("robodk", "placed.robodk.csv", "RoboDK's CSV, the toolpath as placed, machine frame")
