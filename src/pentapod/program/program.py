"""Program: leg-length setpoints at the controller's period, with their provenance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.display import html_table, load_extra
from pentapod.base.errors import MachineError, ProgramError
from pentapod.base.values import Result, Value
from pentapod.geometry.interpolant import Interpolation
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.robot import Branch
from pentapod.machine.machine import Machine
from pentapod.program.resolution import to_millimetres
from pentapod.toolpath.linking.partition import Piece

FORMAT_VERSION = 1
GRAVITY = "gravity"
COMPENSATIONS = (GRAVITY,)
"""Loads to which legs yield and for which the drives can compensate."""
PROCESS = "process"
"""Asks for compensation of gravity, and of the machine's cutting force against the motion on cuts."""


@dataclass(frozen=True)
class Provenance(Value):
    """What a program was made from: names and hashes of its header.

    piece: of the toolpath, where the program is one of several set-ups. processor, libraries: with which it was made;
    with the same ones it is the same to the bit. unverified: it was written for a controller without a passed verdict.
    calibration: name of the machine's calibration, "" where there is none. compensation: "gravity" where drives are to
    be told what the legs yield to it, else "". commands: digest of all by which the rows are commands of drives; ""
    where they are readings of the legs. left_out: pairs of waypoints of the job's toolpath between which it makes no
    cut. upright: whether the tool stands along the view, though the job lets it lean. stepover_share: distance between
    passes, as a share of the job's.

    >>> source = Provenance(machine.name, machine.digest, "", "0.1.0")
    """

    machine: str
    machine_digest: str
    job_digest: str
    pentapod_version: str
    piece: Piece | None = None
    processor: str = ""
    libraries: str = ""
    unverified: bool = False
    calibration: str = ""
    compensation: str = ""
    commands: str = ""
    left_out: tuple[tuple[int, int], ...] = ()
    upright: bool = False
    stepover_share: float = 1.0


@dataclass(frozen=True)
class Switch(Value):
    """What is said of spindle, coolant and tool at a row, as words of G-code such as M8.

    >>> Switch(0, ("T3", "M6", "S12000", "M3"))
    Switch(row=0, words=('T3', 'M6', 'S12000', 'M3'))
    """

    row: int
    words: tuple[str, ...]


@dataclass(frozen=True)
class ProcessForce(Value):
    """A force on the tip against its motion on cuts, newtons. cuts: first and last row of each cut, rising.

    >>> ProcessForce(20.0, ((200, 4100), (4300, 8200)))
    ProcessForce(newtons=20.0, cuts=((200, 4100), (4300, 8200)))
    """

    newtons: float
    cuts: tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class Program(Result):
    """Setpoints for the legs.

    legs (N, n_legs): lengths in metres; row k has the time k · period seconds. interpolation: of the controller between
    rows, "linear", or "cubic": the C2 cubic spline with zero end velocities. component: in which the motion must stay.
    placement: workpiece → machine. rail_positions: of the guides of a reconfigurable machine, metres; None for others.
    switches: spindle, coolant and tool, in the order of their rows. laser_power (N,): share of the laser's full power
    from each row to the next; None where nothing says it. process_force: beside the weight, for which drives
    compensate; None for none.

    >>> program.legs.shape[1], round(program.duration, 1) == round(trajectory.duration, 1)
    (5, True)
    """

    summary = ("duration",)

    period: float
    legs: Floats
    interpolation: Interpolation
    component: Branch
    placement: RigidTransform
    provenance: Provenance
    rail_positions: tuple[float, ...] | None = None
    switches: tuple[Switch, ...] = ()
    laser_power: Floats | None = None
    process_force: ProcessForce | None = None

    def __post_init__(self) -> None:
        set_frozen(self, legs=frozen(self.legs, "legs", (None, None)))
        if self.laser_power is not None:
            set_frozen(self, laser_power=frozen(self.laser_power, "laser_power", (len(self.legs),)))
        rows = [switch.row for switch in self.switches]
        if rows != sorted(set(rows)) or (rows and not 0 <= rows[0] <= rows[-1] < len(self.legs)):
            raise ProgramError("switches must be in the order of their rows", key="switches", value=rows[:8])
        if self.process_force is not None:
            flat, newtons = [row for pair in self.process_force.cuts for row in pair], self.process_force.newtons
            if not flat or flat != sorted(set(flat)) or not 0 <= flat[0] <= flat[-1] < len(self.legs):
                raise ProgramError("cuts must be in the order of their rows", key="cut_rows", value=flat[:8])
            if not (0.0 < newtons < np.inf and self.provenance.compensation):
                what = "a process force is a positive number, of a program that is compensated for gravity, too"
                raise ProgramError(what, key="process_force_n", value=newtons)
        if self.legs.ndim != 2 or len(self.legs) < 2:
            raise ProgramError("a program needs at least two rows", value=self.legs.shape)
        if not (np.isfinite(self.period) and self.period > 0.0):
            raise ProgramError("the period must be positive", value=self.period)

    def machine(self, machine: Machine) -> Machine:
        """Return a machine with its guides at the positions of the program.

        Raises MachineError: it has another number of legs, or is architecturally singular there.
        """
        if machine.robot.n_legs != self.legs.shape[1]:
            raise MachineError(
                "the program is for a machine with another number of legs", key="machine", value=machine.name,
                expected=f"{self.legs.shape[1]} legs, as the program has; this machine has {machine.robot.n_legs}",
            )  # fmt: skip
        return machine if self.rail_positions is None or machine.guides is None else machine.at(self.rail_positions)

    @cached_property
    def times(self) -> Floats:
        """Time (N,) of each row in seconds."""
        return np.arange(len(self.legs), dtype=np.float64) * self.period

    @property
    def duration(self) -> float:
        """Time of the last row in seconds."""
        return (len(self.legs) - 1) * self.period

    def to_frame(self) -> Any:
        """Return leg lengths `leg1_mm`, … by `time_s` as a pandas DataFrame. Raises InputError without pandas."""
        pandas = load_extra("pandas", "pandas", "frames need pandas", key="to_frame")
        names = [f"leg{leg}_mm" for leg in range(1, self.legs.shape[1] + 1)]
        return pandas.DataFrame(to_millimetres(self.legs), pandas.Index(self.times, name="time_s"), names)

    def _repr_html_(self) -> str:
        """Return the HTML for notebooks: duration, interpolation and provenance."""
        low, high = to_millimetres(self.legs).min(axis=0), to_millimetres(self.legs).max(axis=0)
        ranges = ", ".join(f"{a:.3f} to {b:.3f}" for a, b in zip(low, high, strict=True))
        rows = (
            ("rows", f"{len(self.legs):,}, one each {1e3 * self.period:g} ms, {self.interpolation} between them"),
            ("legs, mm", ranges),
            ("component", str(self.component)),
            ("machine", self.provenance.machine),
            ("job", self.provenance.job_digest[:12] or "none"),
            *(("switches", " ".join(switch.words)) for switch in self.switches[:1]),
        )
        return html_table(f"Program: {self.duration:.3f} s", rows)
