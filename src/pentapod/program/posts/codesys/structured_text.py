"""Structured Text of a machine: a function block with CartesianToAxes and AxesToCartesian, with the module's numbers.

Kinematics and margins are those of the LinuxCNC module, in the language of IEC 61131-3. Numbers are decimal with 17
digits, so that a controller reads them exactly.
"""

from __future__ import annotations

from importlib import resources

import numpy as np
from numpy.typing import ArrayLike

from pentapod.machine.machine import Machine
from pentapod.program.posts.linuxcnc.kinematics import controller_frame, upright_component
from pentapod.program.posts.linuxcnc.module import Module, filled, module_names, module_values

SOURCE = "pentapod_kinematics.st"


def structured_text(machine: Machine) -> str:
    """Return the function block of a machine, in the component in which it works upright.

    Raises MachineError where the machine is not of the quadratic family, or its drives are told something else than the
    lengths of its legs.
    """
    component = upright_component(machine)
    given = Module(machine, component, controller_frame(machine, component), ())
    names = module_names(given)
    names["AS_BUILT"] = "TRUE" if names["AS_BUILT"] == "1" else "FALSE"
    words = {**names, **{name: _literal(value) for name, value in module_values(given).items()}}
    text = resources.files("pentapod.program.posts.codesys").joinpath(SOURCE).read_text(encoding="utf-8")
    return filled(text, words)


def _literal(value: ArrayLike) -> str:
    """Return a number, or an array row by row, as a literal of IEC 61131-3; a line for each row of a matrix."""
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 0:
        text = repr(float(array))
        mantissa, exponent, power = text.partition("e")
        point = mantissa if "." in mantissa else f"{mantissa}.0"
        return f"{point}E{int(power)}" if exponent else point
    rows = [", ".join(_literal(one) for one in row) for row in np.atleast_2d(array)]
    return "[" + ",\n        ".join(rows) + "]"
