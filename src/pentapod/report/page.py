"""The report of a run as one self-contained HTML file: the verdict first, then placement, motion and provenance."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.version import __version__, library_versions, processor_kind
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.build.limits import placement_limits
from pentapod.job.build.placement import job_at, placement_toml
from pentapod.job.build.specification import job_collision_world
from pentapod.job.build.tool import job_tool
from pentapod.job.build.toolpath import stem_sentence
from pentapod.job.outcome import Outcome, SetUps
from pentapod.job.plan_arrays import matrix_mm
from pentapod.job.schema.job import Job
from pentapod.kinematics.mode import Mode
from pentapod.machine.clearance.collision_world import NOTHING, CollisionWorld
from pentapod.machine.leg_ends import arms_beside, leg_ends
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning.placement.placed_path import PlacedPath, UnplacedPath
from pentapod.program.program import Program
from pentapod.report import plots, scene, words
from pentapod.report.figure import DETAIL, Figure, as_script
from pentapod.report.held import held_mesh
from pentapod.report.setup_sheet import setup_sheet
from pentapod.report.signals import Signals
from pentapod.report.template import write_page
from pentapod.report.worst import worst_places
from pentapod.timing.explain import Explanation
from pentapod.timing.time_law.trajectory import Trajectory
from pentapod.toolpath.linking.partition import Piece
from pentapod.toolpath.toolpath import SegmentKind, Toolpath


def write_report(outcome: Outcome, path: str | Path) -> Path:
    """Write report.html on a run and return its path. Raises InputError where it cannot be written."""
    return write_page(path, "page.html.j2", **_context(outcome))


def _context(outcome: Outcome) -> dict[str, Any]:
    """Return the variables of the template."""
    failed = [c for c in outcome.verdict.certificates if not c.passed]
    status = "refused" if outcome.refusal is not None else "passed" if outcome.passed else "failed"
    placed, program = outcome.find(PlacedPath), outcome.find(Program)
    trajectory, toolpath = outcome.find(Trajectory), outcome.find(Toolpath)
    signals = None
    if program is not None and trajectory is not None and toolpath is not None:
        world, limits = _collision_world(outcome), placement_limits(outcome.job)
        signals = Signals.of(program, outcome.machine, trajectory, toolpath, world, limits)
    figures: dict[str, Figure] = {"scene": _scene(outcome, signals)}
    if signals is not None:
        figures["time"] = plots.time_figure(signals, outcome.machine)
    return {
        "job": outcome.job,
        "machine": outcome.machine,
        "status": status,
        "certificates": sorted(outcome.verdict.certificates, key=lambda c: c.passed),
        "failed": failed,
        "unjudged": [entry for entry in outcome.verdict.not_judged if not entry.waived],
        "waived": [entry for entry in outcome.verdict.not_judged if entry.waived],
        "refusal": outcome.refusal,
        "facts": _facts(outcome, signals),
        "worst": [] if signals is None else worst_places(signals, outcome.machine),
        "story": outcome.find(Explanation),
        "sheet": _preparations(outcome, signals),
        "placement": None if placed is None else _placement(outcome.job, placed.placement.transform),
        "setups": outcome.find(SetUps),
        "one_of_several": outcome.find(Piece) is not None,
        "setup_sheet": setup_sheet(outcome),
        "chosen_by": "" if placed is None else placed.placement.chosen_by,
        "component": "" if placed is None else str(placed.component),
        "component_signs": (
            "signs of the singularity polynomial and of w"
            if placed is not None and isinstance(placed.component, Mode)
            else "signs of w and S"
        ),
        "stages": outcome.stages,
        "program": program,
        "poses_shown": signals is not None,
        "provenance": _provenance(outcome),
        "figures": as_script(figures),
        "poses": as_script(_poses(outcome, signals)),
    }


def _collision_world(outcome: Outcome) -> CollisionWorld:
    """Return the collision world of the planner."""
    mesh = outcome.find(Mesh)
    return NOTHING if mesh is None else job_collision_world(outcome.job, outcome.machine, mesh)


def _facts(outcome: Outcome, signals: Signals | None) -> list[tuple[str, str]]:
    """Return names and values of the numbers at the top."""
    toolpath, placed = outcome.find(Toolpath), outcome.find(PlacedPath)
    program = outcome.find(Program)
    facts: list[tuple[str, str]] = []
    if program is not None:
        facts.append(("machining time", words.duration(program.duration)))
        facts.append(("rows", f"{len(program.legs):,}"))
    if toolpath is not None:
        facts.append(("waypoints", f"{len(toolpath):,}"))
    if signals is not None:
        facts.append(("smallest margin", words.number(float(signals.smallest_margins.min()))))
    elif placed is not None:
        facts.append(("smallest margin", words.number(placed.smallest_margin)))
    if placed is not None:
        facts.append(("component", str(placed.component)))
    return facts


def _scene(outcome: Outcome, signals: Signals | None) -> Figure:
    """Return the 3D figure: in the machine where a placement was found or tried, else the workpiece alone."""
    mesh, toolpath, refusal = outcome.find(Mesh), outcome.find(Toolpath), outcome.refusal
    placed = outcome.find(PlacedPath)
    if placed is None and isinstance(refusal, UnplacedPath):
        placed = refusal.attempt
    transform = RigidTransform.identity() if placed is None else placed.placement.transform
    traces = [] if mesh is None else [scene.part_trace(mesh, transform, down=placed is not None)]
    traces += [] if mesh is None else scene.fault_traces(mesh, transform)
    if placed is not None and (held := held_mesh(outcome, placed)) is not None:
        traces.append(scene.fixture_trace(held, down=True))
    if signals is not None:
        traces += scene.path_traces(signals)
        row = _start_row(signals)
        traces += scene.machine_traces(outcome.machine, signals.tips[row], signals.axes[row])
    elif toolpath is not None and refusal is not None:
        shown = toolpath if placed is None else placed
        traces += scene.refused_traces(shown.tips, shown.axes, refusal)
        if placed is not None:
            worst, rail_positions = int(placed.margins.min(axis=1).argmin()), placed.placement.rail_positions
            machine = outcome.machine if rail_positions is None else outcome.machine.at(rail_positions)
            traces += scene.machine_traces(machine, placed.tips[worst], placed.axes[worst])
    elif toolpath is not None and (setups := outcome.find(SetUps)) is not None:
        traces += scene.piece_traces(toolpath, [part.piece for part in setups.parts])
    return scene.scene_figure(traces, down=placed is not None)


def _start_row(signals: Signals) -> int:
    """Return the row shown first: the one with the smallest margin."""
    return int(signals.margin_rows[int(signals.smallest_margins.argmin())])


def _poses(outcome: Outcome, signals: Signals | None) -> dict[str, Any]:
    """Return the poses of the slider, and the other data of the page's script, mm."""
    if signals is None:
        return {"poses": []}
    machine = outcome.machine
    rows = np.linspace(0, len(signals.times) - 1, min(DETAIL.poses, len(signals.times))).astype(np.intp)
    # Every place that a table links to has a pose of its own.
    linked = [c.where.row for c in outcome.verdict.certificates if c.where.row is not None]
    linked += [place.row for place in worst_places(signals, machine) if place.row is not None]
    rows = np.unique(np.concatenate([rows, [_start_row(signals)], np.clip(linked, 0, len(signals.times) - 1)]))
    rows = rows.astype(np.intp)
    base, joints = leg_ends(machine, signals.tips[rows], signals.axes[rows])
    tips, axes = np.round(1e3 * signals.tips[rows], 3), np.round(signals.axes[rows], 6)
    return {
        "poses": [
            {"t": round(float(t), 3), "tip": tip, "axis": axis, "joints": ends, "segment": int(segment)}
            for t, tip, axis, ends, segment in zip(
                signals.times[rows],
                tips.tolist(),
                axes.tolist(),
                np.round(1e3 * joints, 3).tolist(),
                signals.segments[rows],
                strict=True,
            )
        ],
        "start": int(np.searchsorted(rows, _start_row(signals))),
        "around": _around(signals),
        "moving": scene.moving_traces(machine),
        "colours": scene.CUTS_BY,
        "base": np.round(1e3 * base, 3).tolist(),
        "arms": [
            [k, round(1e3 * height, 3)] for k, height in zip(*(x.tolist() for x in arms_beside(machine)), strict=True)
        ],
        "limb": _limb(machine),
        "line_top": 1e3 * (machine.tool_length - machine.line_top),
        "shaft_end": 1e3 * machine.bodies.shaft_end,
    }


def _limb(machine: Machine) -> dict[str, Any] | None:
    """Return rail and joint of the passive limb, mm: the script draws its strut."""
    limb = machine.limb
    if limb is None:
        return None
    return {
        "origin": (1e3 * limb.origin).tolist(),
        "rail": limb.rail.tolist(),
        "height": 1e3 * (machine.tool_length - limb.joint),
    }


def _around(signals: Signals) -> list[list[float]]:
    """Return ranges in x, y and z, mm, that hold the cuts and a little more."""
    tips = 1e3 * signals.tips[signals.cutting] if signals.cutting.any() else 1e3 * signals.tips
    low, high = tips.min(axis=0), tips.max(axis=0)
    room = 0.1 * float((high - low).max()) + 2.0
    return np.stack([low - room, high + room], axis=1).round(2).tolist()


def _placement(job: Job, transform: RigidTransform) -> dict[str, Any]:
    rows = matrix_mm(transform).tolist()
    return {
        "sentences": words.placement_sentences(transform),
        "matrix": [[f"{round(value, 6) + 0.0:.6f}".replace("-", "−") for value in row] for row in rows],
        "toml": placement_toml(job_at(job, transform).placement),
    }


def _preparations(outcome: Outcome, signals: Signals | None) -> list[tuple[str, str]]:
    """Return names and values of what the operator has to prepare."""
    job, machine, toolpath = outcome.job, outcome.machine, outcome.find(Toolpath)
    sheet = [
        ("tool", "; ".join(filter(None, (words.tool_sentence(job.tool), stem_sentence(job_tool(job, machine)))))),
        ("tool length", f"{1e3 * machine.tool_length:.3f} mm from the platform's origin to the tip"),
    ]
    placed = outcome.find(PlacedPath)
    if placed is not None and placed.placement.guides:
        rail_positions = placed.placement.guides.replace("-", "−")
        sheet.append(
            (f"guides 1 to {machine.robot.n_legs}", f"set to {rail_positions} from the base joints of the machine file")
        )
    if placed is not None and placed.common_axis is not None:
        sheet.append(("tool axis", f"{placed.common_axis}; {placed.lean}".replace("-", "−")))
    mesh = outcome.find(Mesh)
    if mesh is not None:
        size = " × ".join(f"{value:.1f}" for value in 1e3 * np.ptp(mesh.bounds, axis=0))
        sheet.append(("part", f"{job.mesh_path.name}, {size} mm"))
    if toolpath is not None:
        feeds = sorted({round(6e4 * s.feed) for s in toolpath.segments if s.kind == SegmentKind.CUT})
        sheet.append(("feed on cuts", f"{', '.join(f'{feed:,}' for feed in feeds[:4])} mm/min"))
    if signals is not None:
        for name, row in (("first row", 0), ("last row", -1)):
            tip = ", ".join(f"{value:.2f}" for value in 1e3 * signals.tips[row]).replace("-", "−")
            legs = ", ".join(f"{value:.3f}" for value in 1e3 * signals.legs[row])
            sheet.append((name, f"tip at ({tip}) mm, legs {legs} mm"))
        sheet.append(("rapid rate", f"{6e4 * machine.rapid_velocity:,.0f} mm/min"))
    return sheet


def _provenance(outcome: Outcome) -> list[tuple[str, str]]:
    job, machine = outcome.job, outcome.machine
    files = asdict(outcome.verdict.sources)
    return [
        ("job", f"{job.path.name}, {job.digest}"),
        ("mesh", job.mesh_path.name),
        ("machine", f"{machine.name}, {machine.digest}"),
        *((("calibration", machine.calibration_name),) if machine.calibration_name else ()),
        ("controller", f"a row every {1e3 * machine.controller.period:g} ms, {machine.controller.interpolation}"),
        ("pentapod", __version__),
        ("libraries", library_versions()),
        ("processor", processor_kind()),
        *((f"SHA-256 of the {name.replace('_', ' ')}", digest) for name, digest in files.items() if digest is not None),
    ]
