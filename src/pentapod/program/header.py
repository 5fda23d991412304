"""The header of a program file: `# key = value` lines, each value in TOML syntax."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pentapod.base.arrays import Floats
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.program.header_values import (
    box_text,
    decimal_text,
    matrix_text,
    pairs_text,
    string_text,
    switches_text,
)
from pentapod.program.program import FORMAT_VERSION, ProcessForce, Program, Provenance, Switch

MAGIC = "pentapod_program"
KEYS = (
    MAGIC,
    "pentapod_version",
    "machine",
    "machine_digest",
    "job_digest",
    "period_s",
    "interpolation",
    "component",
    "placement_mm",
    "rows",
)
GUIDES = "guides_mm"
"""Key of programs of reconfigurable machines."""
WAYPOINTS, BOX = "setup_waypoints", "setup_box_mm"
SETUP_KEYS = (WAYPOINTS, BOX)
"""Keys of programs of several set-ups."""
CALIBRATION = "calibration"
"""Key of programs for a machine as it was measured."""
COMPENSATION = "compensation"
"""Key of programs with which drives are told more than the lengths of the legs, because legs yield to their loads."""
PROCESS_FORCE, CUT_ROWS = "process_force_n", "cut_rows"
FORCE_KEYS = (PROCESS_FORCE, CUT_ROWS)
"""Keys of programs that compensate for a force against the motion, too: newtons, and the rows of the cuts."""
COMMANDS = "commands"
"""Key of files in which the rows are what drives are told, by a machine's leg model, and what its legs yield."""
LEFT_OUT = "left_out"
"""Key of programs that leave cuts of the toolpath out: pairs of waypoints."""
UPRIGHT = "upright"
"""Key of programs whose tool stands along the view, though their job lets it lean."""
STEPOVER_SHARE = "stepover_share"
"""Key of programs whose passes are nearer together than their job asks: a share of its distance."""
SWITCHES = "switches"
"""Key of programs that switch spindle, coolant and tool: lists of a row and its words of G-code."""
LASER_POWER = "laser_power"
"""Key of programs whose last column is the laser's power, a share of full power from each row to the next."""
LEGS = "legs"
"""Key of programs for machines that have not as many legs as a linear pentapod."""
MADE_ON = ("processor", "libraries")
"""Keys of planned programs: on another kind of processor or with other libraries bits may differ."""
OPTIONAL_KEYS = (
    LEGS,
    CALIBRATION,
    COMPENSATION,
    *FORCE_KEYS,
    COMMANDS,
    GUIDES,
    *SETUP_KEYS,
    LEFT_OUT,
    UPRIGHT,
    STEPOVER_SHARE,
    SWITCHES,
    LASER_POWER,
    *MADE_ON,
)
UNVERIFIED = "UNVERIFIED: no verdict has passed this program"
"""First line, after the comment mark, of files written for a controller without a passed verdict."""


@dataclass(frozen=True)
class Header:
    """What stands in front of the rows."""

    period: float
    interpolation: Any
    component: Component
    placement: RigidTransform
    provenance: Provenance
    rows: int
    rail_positions: tuple[float, ...] | None = None
    legs: int = FiveLegs.n_legs
    switches: tuple[Switch, ...] = ()
    powered: bool = False
    process_force: ProcessForce | None = None

    def program(self, legs: Floats, laser_power: Floats | None = None) -> Program:
        """Return the program of this header and its rows: legs (N, n_legs), metres, and the laser's power (N,)."""
        before = (self.period, legs, self.interpolation, self.component, self.placement, self.provenance)
        return Program(*before, self.rail_positions, self.switches, laser_power, self.process_force)


def header_text(program: Program) -> str:
    """Return the header lines of a program, each ended by a newline."""
    source = program.provenance
    values = {
        MAGIC: str(FORMAT_VERSION),
        "pentapod_version": string_text(source.pentapod_version),
        "machine": string_text(source.machine),
        "machine_digest": string_text(source.machine_digest),
        "job_digest": string_text(source.job_digest),
        "period_s": repr(float(program.period)),
        "interpolation": string_text(program.interpolation),
        "component": string_text(str(program.component)),
        "placement_mm": matrix_text(program.placement),
        "rows": str(len(program.legs)),
    }
    if program.legs.shape[1] != FiveLegs.n_legs:
        values[LEGS] = str(program.legs.shape[1])
    if source.calibration:
        values[CALIBRATION] = string_text(source.calibration)
    if source.compensation:
        values[COMPENSATION] = string_text(source.compensation)
    if program.process_force is not None:
        values[PROCESS_FORCE] = repr(float(program.process_force.newtons))
        values[CUT_ROWS] = pairs_text(program.process_force.cuts)
    if source.commands:
        values[COMMANDS] = string_text(source.commands)
    if program.rail_positions is not None:
        values[GUIDES] = f"[{', '.join(decimal_text(x, 3) for x in program.rail_positions)}]"
    if source.piece is not None:
        values |= {WAYPOINTS: f"[{source.piece.first}, {source.piece.last}]", BOX: box_text(source.piece)}
    if source.left_out:
        values[LEFT_OUT] = pairs_text(source.left_out)
    if source.upright:
        values[UPRIGHT] = "true"
    if source.stepover_share < 1.0:
        values[STEPOVER_SHARE] = repr(float(source.stepover_share))
    if program.switches:
        values[SWITCHES] = switches_text(program.switches)
    if program.laser_power is not None:
        values[LASER_POWER] = "true"
    made_on = zip(MADE_ON, (source.processor, source.libraries), strict=True)
    values |= {key: string_text(value) for key, value in made_on if value}
    mark = f"# {UNVERIFIED}\n" if source.unverified else ""
    return mark + "".join(f"# {key} = {value}\n" for key, value in values.items())
