"""What a set-up sheet says in words and numbers: tool, part, poses, cycle time, and what to check before the start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.units import from_si
from pentapod.cutters.mounted import Mounted
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.solids import Cone
from pentapod.job.build.region import covers_region, job_region
from pentapod.mesh.region_share import RegionShare
from pentapod.program.commands import compensation_sentence
from pentapod.report import words
from pentapod.report.drawings.planned_run import PlannedRun
from pentapod.report.drawings.touch_off import TouchOff
from pentapod.report.drawings.views import words_of
from pentapod.toolpath.process import Process
from pentapod.toolpath.toolpath import SegmentKind

Fact = tuple[str, str]

OPERATIONS = {SegmentKind.CUT: "cuts", SegmentKind.LINK: "links, on feed", SegmentKind.RAPID: "rapids"}
"""Kinds of segments, in the order in which the sheet names them."""


@dataclass(frozen=True)
class Row:
    """A row of the table of cycle times: what, how many, millimetres, feed and time as text."""

    what: str
    count: str
    length: str
    feed: str
    time: str


@dataclass(frozen=True)
class PoseRow:
    """A row of the table of poses, as text: tip, legs, where the part is touched; mm."""

    name: str
    tip: str
    legs: str
    touches: str


def tool_facts(run: PlannedRun) -> list[Fact]:
    """Return names and values of the tool: what to put into the spindle, and how far it must stick out."""
    job, machine, tool, program = run.job, run.machine, run.tool, run.program
    facts = [("tool", words.tool_sentence(job.tool))]
    facts.append(("stick-out", f"{_mm(machine.bodies.shaft_end)}, spindle's nose to tip"))
    facts.append(("length", f"{_mm(machine.tool_length, 3)}, platform's origin to tip"))
    if isinstance(tool, Mounted):
        for kind, pieces in (("shank", tool.shank), ("holder", tool.holder)):
            if pieces:
                texts = [_piece(p) for p in pieces]
                facts.append((kind, "; ".join(texts)))
        if tool.stem is not None:
            wide = 2.0 * max(solid.largest_radius for solid in tool.solids)
            facts.append(("stem", f"not given: ⌀ {_mm(wide)} assumed up to the spindle"))
    if program is not None and program.switches:
        facts += [("process", str(Process().after(program.switches[0].words)) or "see the program's switches")]
    if program is not None and program.laser_power is not None:
        facts.append(("laser", f"up to {100.0 * float(program.laser_power.max()):.3g} % of full power"))
    if program is not None and (compensated := compensation_sentence(program, machine)):
        facts.append(("drives", compensated))
    if program is not None and program.rail_positions is not None:
        facts.append(("guides", ", ".join(words_of(1e3 * x, 3) for x in program.rail_positions)))
    return facts


def stand_facts(run: PlannedRun) -> list[Fact]:
    """Return names and values of how the part stands and on what."""
    stand, job = run.stand, run.job
    size = " × ".join(_mm(value, 1) for value in np.ptp(run.mesh.bounds, axis=0))
    facts = [("part", f"{job.mesh_path.name}, {size}"), ("datum", "origin of the mesh; X, Y, Z are its axes")]
    if covers_region(job):
        share = RegionShare.of(run.mesh, job_region(job)).inside
        box = "" if job.part.region_box_mm is None else f", in the box {_box(job.part.region_box_mm)}"
        facts.append(("machined", f"{100.0 * share:.3g} % of the surface{box}"))
    if (stock := job.part.si.stock) is not None:
        size = " × ".join(_mm(value, 1) for value in stock)
        facts.append(("stock", f"{size} along X, Y, Z; nothing is judged by it"))
    x, y, z = (words_of(value) for value in 1e3 * run.placement.translation)
    facts.append(("origin at", f"x {x}, y {y}, z {z}"))
    facts.append(
        ("turn", f"{stand.turned.upper()} points to {words_of(np.degrees(stand.turn), 2)}° (0° is x, 90° is y)")
    )
    upwards = int(np.argmax(np.abs(stand.up)))
    facts.append(("up", f"{'−' if stand.up[upwards] < 0.0 else '+'}{'XYZ'[upwards]} of the mesh"))
    if run.table is not None:
        facts.append(("table", f"surface at z {words_of(1e3 * run.table)}, as the job says, and the part on it"))
    else:
        facts.append(("table", f"none given; the part goes down to z {words_of(1e3 * run.lowest)}"))
    if stand.is_tilted:
        azimuth = words_of(np.degrees(stand.azimuth), 1)
        facts.append(("wedge", f"{words_of(np.degrees(stand.lean))}°, low side towards {azimuth}°"))
    if run.held is not None:
        facts.append(("fixture", f"{job.fixture_mesh.name if job.fixture_mesh else ''}, as drawn"))
    return facts


def machine_sentence(run: PlannedRun) -> str:
    """Return the machine, its calibration, and the file of the program."""
    machine = run.machine
    calibrated = f", calibration {machine.calibration_name}" if machine.calibration_name else ""
    return f"Machine {machine.name} ({machine.digest}{calibrated})."


def poses(run: PlannedRun, points: Sequence[TouchOff]) -> list[PoseRow]:
    """Return rows of poses: the first, those at touch-off points, the last, home, and the park pose if there is one."""
    touches = [
        PoseRow(f"touch-off {k}", _list(1e3 * p.tip, 2), _list(1e3 * p.legs, 3), _list(1e3 * p.in_machine, 2))
        for k, p in enumerate(points, start=1)
    ]
    first, *others = (
        PoseRow(name, _list(1e3 * p.tip, 2), _list(1e3 * p.legs, 3), "")
        for name, p in (("start", run.first), ("end", run.last), ("home", run.home), ("park", run.park))
        if p is not None
    )
    return [first, *touches, *others]


def cycle(run: PlannedRun) -> list[Row]:
    """Return the rows of the table of cycle times: cuts, links, rapids, and all; none without a program."""
    times, program = run.segment_times, run.program
    if times is None or program is None:
        return []
    segments = run.toolpath.segments
    lengths = np.array([arc_length(s.tips)[-1] for s in segments])
    rows: list[Row] = []
    for kind, name in OPERATIONS.items():
        here = np.array([s.kind is kind for s in segments])
        if here.any():
            feeds = sorted(
                {min(s.feed, run.machine.rapid_velocity) for s, own in zip(segments, here, strict=True) if own}
            )
            feed = ", ".join(f"{6e4 * value:,.0f}" for value in feeds[:3]) + (", …" if len(feeds) > 3 else "")
            rows.append(_row(name, int(here.sum()), float(lengths[here].sum()), feed, float(times[here].sum())))
    rows.append(_row("all", len(segments), float(lengths.sum()), "", program.duration))
    return rows


def checks(run: PlannedRun, digest: str) -> list[str]:
    """Return what the operator has to check before the start. digest: SHA-256 of the program's file."""
    done = ["Machine referenced; no alarm."]
    if run.program is not None and run.program.rail_positions is not None:
        done.append("Guides at the positions above, and locked.")
    done.append("Tool, stick-out and stem as above; spindle on at the speed for this tool.")
    done.append("Part, or stock: size and raw side as above, clean seat.")
    if run.stand.is_tilted and run.table is None:
        done.append(f"Wedge of {words_of(np.degrees(run.stand.lean))}° under the part, low side as drawn.")
    judged = "Fixture as drawn." if run.held else "The job names no fixture: nothing has judged the clamps."
    done.append(f"Clamps outside the tool path, and below the legs. {judged}")
    done.append("At the three touch-off points the tool just touches; else: pentapod register, replan.")
    done.append("Way from the present pose to the first one is free.")
    done.append(f"SHA-256 of program.csv begins with {digest[:12]}.")
    done.append("Dry run without the part, at 10 % of the pace; hand at the stop.")
    return done


def _row(what: str, count: int, length: float, feed: str, seconds: float) -> Row:
    return Row(what, f"{count:,}", f"{1e3 * length:,.0f}", feed, words.duration(seconds))


def _piece(cone: Cone) -> str:
    low, high = _mm(2.0 * cone.lower_radius), _mm(2.0 * cone.upper_radius)
    return f"{_mm(cone.height)} long, ⌀ {low if low == high else f'{low} to {high}'}"


def _mm(value: float, digits: int = 4) -> str:
    return f"{float(from_si(value, 'mm')):.6g}" if digits > 1 else f"{float(from_si(value, 'mm')):.1f}"


def _box(corners: tuple[Sequence[float], Sequence[float]]) -> str:
    """Return a box of the mesh's frame as text, mm."""
    ends = zip("XYZ", *corners, strict=True)
    return ", ".join(f"{axis} {words_of(low)} to {words_of(high)}" for axis, low, high in ends)


def _list(values: Floats, digits: int) -> str:
    return ", ".join(words_of(value, digits) for value in values.tolist())
