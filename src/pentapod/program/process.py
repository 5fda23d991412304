"""Process data of a program: what its toolpath says of spindle, coolant, tool and laser, at the rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pentapod.program.csv_rows import POWER_DECIMALS
from pentapod.program.program import ProcessForce, Program, Switch
from pentapod.timing.time_law.trajectory import Trajectory
from pentapod.toolpath.process import laser_power
from pentapod.toolpath.toolpath import SegmentKind, Toolpath


def with_process_force(program: Program, trajectory: Trajectory, toolpath: Toolpath, newtons: float) -> Program:
    """Return a program whose drives compensate for a force against the motion on the cuts of its toolpath."""
    kinds = np.array([segment.kind is SegmentKind.CUT for segment in toolpath.segments])
    cutting = kinds[np.asarray(trajectory.segment(program.times[:-1] + 0.5 * program.period))]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], cutting, [False]])))
    cuts = tuple((int(first), int(end) - 1) for first, end in edges.reshape(-1, 2) if end - first > 1)
    return replace(program, process_force=ProcessForce(newtons, cuts)) if cuts else program


def with_process(program: Program, trajectory: Trajectory, toolpath: Toolpath) -> Program:
    """Return a program with what its toolpath says of spindle, coolant, tool and laser; most toolpaths say nothing.

    Words hold from the row that is nearest to the start of their segment. The laser is off wherever the toolpath does
    not cut. toolpath: that of the trajectory.
    """
    said = [*(segment.words for segment in toolpath.segments), toolpath.end_words]
    if not any(said):
        return program
    last = len(program.legs) - 1
    owner = np.asarray(trajectory.segment(program.times[:-1] + 0.5 * program.period))
    starts = np.append(np.searchsorted(owner, np.arange(len(toolpath.segments))), last)
    starts[0] = 0
    switches: dict[int, tuple[str, ...]] = {}
    share, shares = None, list[float]()
    for row, words in zip(starts.tolist(), said, strict=True):
        powers = [power for word in words if (power := laser_power(word)) is not None]
        share = powers[-1] if powers else share
        shares.append(share or 0.0)
        others = tuple(" ".join(word.split()) for word in words if laser_power(word) is None)
        if others:
            switches[row] = (*switches.get(row, ()), *others)
    found = tuple(Switch(row, words) for row, words in sorted(switches.items()))
    if share is None:
        return replace(program, switches=found)
    cutting = np.array([segment.kind is SegmentKind.CUT for segment in toolpath.segments])
    power = np.append(np.where(cutting, shares[:-1], 0.0)[owner], 0.0)
    return replace(program, switches=found, laser_power=np.round(power, POWER_DECIMALS))
