"""LinuxCNC's own sample of pentakins, base beside the tool: imported, planned, posted, played by LinuxCNC itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from linuxcnc_kinematics import asked, called
from linuxcnc_runs import play, real
from pentapod import Job, Machine
from pentapod import run as run_job
from pentapod.cli.main import run
from pentapod.job.measuring.measuring import MeasuringPlan, plan_measuring
from pentapod.program import Program

SAMPLE = Path("/usr/share/doc/linuxcnc/examples/sample-configs/sim/axis/pentapod")
# Leg by leg: base joint x, y, z, and height of the ring; all rings have 80.3 mm.
ROWS = [
    (-418, 500, -140, 87),
    (418, 500, -140, 114.5),
    (0, 500, -310, 140.5),
    (418, 500, 510, 232.5),
    (-418, 500, 510, 258.5),
]
CHANGES = (
    ('name = "desk"', 'file = "sample.toml"'), ("stepover_mm = 6.0", "stepover_mm = 8.0"),
    ("table_z_mm = 471.0", "table_z_mm = 90.0"),
)  # fmt: skip


def imported(folder: Path) -> Machine:
    """The machine of the sample's files, or of the same numbers where its folder is not installed."""
    names = ("base.{0}.x", "base.{0}.y", "base.{0}.z", "effector.{0}.z")
    lines = [f"setp pentakins.{n.format(k)} {v}" for k, row in enumerate(ROWS) for n, v in zip(names, row, strict=True)]
    rings = [f"setp pentakins.effector.{k}.r 80.30" for k in range(5)]
    (folder / "kinematics.hal").write_text("\n".join([*lines, *rings]) + "\n", encoding="utf-8")
    limits = "MIN_LIMIT = 400.0\nMAX_LIMIT = 1500.0\nMAX_VELOCITY = 100.0\nMAX_ACCELERATION = 1000.0\n"
    (folder / "pentapod.ini").write_text("".join(f"[JOINT_{k}]\n{limits}" for k in range(5)), encoding="utf-8")
    source, out = SAMPLE if SAMPLE.exists() else folder, folder / "sample.toml"
    words = ["machine", "import", "hal", str(source / "kinematics.hal"), "--ini", str(source / "pentapod.ini")]
    assert run([*words, "-o", str(out)]) == 0
    return Machine.load(out)


def test_installed_sample_is_the_one_that_is_known_here(tmp_path) -> None:
    machine = imported(tmp_path)
    base = 1e-3 * np.array([row[:3] for row in ROWS]) - [0.0, 0.0, 0.086]
    np.testing.assert_allclose(machine.robot.base_joints, base * [1.0, -1.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(machine.tool_length - machine.robot.offsets, [1e-3 * row[3] for row in ROWS])
    assert (machine.robot.radii == 0.0803).all()
    assert (machine.legs.max_velocity == 0.1).all()


@pytest.mark.slow
def test_measuring_of_the_sample_is_planned_and_passes(tmp_path) -> None:
    made = plan_measuring(imported(tmp_path), tmp_path / "poses", 20)
    assert isinstance(made, MeasuringPlan), made
    assert made.verdict.passed, [claim for claim in made.verdict.certificates if not claim.passed]


@pytest.mark.slow
@real
@called
def test_sample_is_planned_and_played_by_linuxcnc(tmp_path) -> None:
    assert run(["new", str(tmp_path / "part"), "--quiet"]) == 0
    machine, job = imported(tmp_path / "part"), tmp_path / "part" / "job.toml"
    text = job.read_text(encoding="utf-8")
    for old, new in CHANGES:
        assert old in text
        text = text.replace(old, new)
    job.write_text(text, encoding="utf-8")
    outcome = run_job(Job.load(job), tmp_path / "out", advice=None)
    assert outcome.passed, [claim for claim in outcome.verdict.certificates if not claim.passed]

    program = outcome.find(Program)
    p, i = machine.robot.pose(program.legs, program.component)
    tips = p + machine.tool_length * i
    some = slice(None, None, 50)
    a, b = np.arcsin(-i[some, 1]), np.arctan2(i[some, 0], i[some, 2])
    theirs, position, direction = asked(machine.robot, p[some], np.degrees(np.stack([a, b], axis=1)), tmp_path)
    assert np.abs(theirs - program.legs[some]).max() < 1e-9
    assert np.abs(position + machine.tool_length * direction - tips[some]).max() < 1e-9

    assert run(["post", str(tmp_path / "out" / "program.csv"), "--to", "linuxcnc", "-o", str(tmp_path / "posted")]) == 0
    # Rings of 80 mm: no closed form, so no module. The setpoints are played as they are.
    assert "no kinematics module for such a machine" in (tmp_path / "posted/README.md").read_text(encoding="utf-8")
    table = play(tmp_path / "posted" / "stream")
    np.testing.assert_array_equal(table[:, :5], table[:, 5:10])
    assert np.abs(table[-1, 5:10] - 1e3 * program.legs[-1]).max() < 1e-6
