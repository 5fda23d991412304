"""What the page says of a run beside its verdict: what the operator prepares, and what it was made from."""

from __future__ import annotations

import numpy as np

from pentapod.base.version import __version__, library_versions, processor_kind
from pentapod.job.build.tool import job_tool
from pentapod.job.build.toolpath import Reports, machined_share, stem_sentence
from pentapod.job.outcome import Outcome
from pentapod.mesh.mesh import Mesh
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.program.program import Program
from pentapod.report import words
from pentapod.report.signals import Signals
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

MOST_FEEDS = 4


def facts(outcome: Outcome) -> list[str]:
    """Return what the run is about, in a few words each: machine, part, tool, size of path and program."""
    mesh, toolpath, program = outcome.find(Mesh), outcome.find(Toolpath), outcome.find(Program)
    told = [outcome.machine.name]
    if mesh is not None:
        size = " × ".join(f"{value:.0f}" for value in 1e3 * np.ptp(mesh.bounds, axis=0))
        told.append(f"{outcome.job.mesh_path.name}, {size} mm")
    if (reports := outcome.find(Reports)) is not None and (machined := machined_share(reports)) < 1.0:
        told.append(f"{100.0 * machined:.3g} % of the surface is machined: the region of the job")
    told.append(words.tool_sentence(outcome.job.tool))
    if toolpath is not None:
        told.append(f"{len(toolpath):,} waypoints")
    if program is not None:
        told.append(f"{len(program.legs):,} rows")
    if (placed := outcome.find(PlacedPath)) is not None:
        told.append(f"component {placed.component}")
    return told


def preparations(outcome: Outcome, signals: Signals | None) -> list[tuple[str, str]]:
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
        sheet.append(("feed on cuts", f"{', '.join(f'{feed:,}' for feed in feeds[:MOST_FEEDS])} mm/min"))
    if signals is not None:
        for name, row in (("first row", 0), ("last row", -1)):
            tip = ", ".join(f"{value:.2f}" for value in 1e3 * signals.tips[row]).replace("-", "−")
            legs = ", ".join(f"{value:.3f}" for value in 1e3 * signals.legs[row])
            sheet.append((name, f"tip at ({tip}) mm, legs {legs} mm"))
        sheet.append(("rapid rate", f"{6e4 * machine.rapid_velocity:,.0f} mm/min"))
    return sheet


def provenance(outcome: Outcome) -> list[tuple[str, str]]:
    """Return names and values of what the run was made from and with."""
    job, machine = outcome.job, outcome.machine
    files = outcome.verdict.sources.to_dict()
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
