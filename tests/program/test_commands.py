"""Commands that compensate for what legs yield to weight: made, undone, judged, refused where nothing is known."""

import json
import re
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from page_arrays import page_arrays, page_data
from pentapod.base.errors import InputError, JobError, MachineError, ProgramError
from pentapod.cli.commands.new import dome_stl
from pentapod.cli.main import run
from pentapod.geometry import RigidTransform
from pentapod.job import Job
from pentapod.job.build.values import is_compensated, job_machine
from pentapod.job.verdict import judge
from pentapod.kinematics import AsBuiltPentapod, Component
from pentapod.machine import Dynamics, LegModel, Machine, Stiffness
from pentapod.machine.calibration.record import CalibrationRecord, MeasuredGeometry
from pentapod.program import Program, Provenance, read_csv, write_csv
from pentapod.program.commands import SMOOTH_S, commanded, compensation_sentence, read_back
from pentapod.program.joined import joined
from pentapod.program.posts import PostInput, find_post, read_post, write_post
from pentapod.program.program import ProcessForce
from usual_job import job_text

LIBRARY = Path(__file__).parents[2] / "src" / "pentapod" / "machine" / "library"
POSTS = ("csv", "npz", "ros2-yaml", "pvt", "linuxcnc")
QUANTUM = 1e-11


def machine_of(**more):
    return replace(Machine.load("desk"), **more)


SOFT = Stiffness(leg_stiffness=np.array([20e6, 15e6, 30e6, 20e6, 25e6]), joint_stiffness=np.full(5, 80e6))
AXES = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
RINGS = [1e-4, 0.0, 3e-4, 2e-3, 6e-3]
MACHINES = {
    "springs": machine_of(stiffness=SOFT),
    "screws": machine_of(stiffness=Stiffness(leg_rigidity=np.full(5, 8e6)), leg_model=LegModel(5e-3, AXES, 1e-5)),
    "heavy": machine_of(
        stiffness=SOFT, masses=replace(Machine.load("desk").masses, platform=20.0, gravity=np.array([1.0, -2.0, 9.5]))
    ),
    "calibrated": machine_of(
        stiffness=SOFT, robot=AsBuiltPentapod.of(Machine.load("desk").robot, radii=RINGS, zeros=3e-4)
    ),
}


def program_of(machine, compensation="gravity", force=None):
    """A motion of 20 mm that leans the tool."""
    share = np.linspace(0.0, 1.0, 60)[:, None]
    tips = machine.work.centre + 0.02 * np.hstack([share, -share, 0.5 * share])
    axes = np.hstack([0.2 * share, 0.1 * share, -np.ones_like(share)])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    legs = np.round(machine.robot.leg_lengths(tips + machine.tool_length * axes, -axes), 11)
    source = Provenance(machine.name, machine.digest, "", "1", compensation=compensation)
    return Program(1e-3, legs, "cubic", Component(1, 1), RigidTransform.identity(), source, process_force=force)


@pytest.mark.parametrize("name", MACHINES)
def test_a_leg_is_longer_by_its_load_over_its_stiffness(name):
    """Springs in series by hand; the force is that of the dynamics, which MuJoCo confirms elsewhere."""
    machine = replace(MACHINES[name], leg_model=LegModel())
    program = program_of(machine)
    told = commanded(program, machine)
    position, direction = machine.robot.pose(program.legs, program.component)
    still = np.zeros_like(program.legs)
    force = Dynamics.of(machine).of_rows(position, direction, still, still).weight
    soft, long = machine.stiffness, np.linalg.norm(machine.robot.leg_vectors(position, direction), axis=-1)
    expected = force / soft.leg_stiffness + force / soft.joint_stiffness + force * long / soft.leg_rigidity
    assert np.abs(expected).max() > 1e-6
    assert np.abs(told.legs - program.legs - expected).max() <= QUANTUM
    assert commanded(told, machine) is told, "once is enough"
    assert np.array_equal(commanded(program_of(machine, ""), machine).legs, program.legs)


@pytest.mark.parametrize("post", POSTS)
@pytest.mark.parametrize("force", [None, ProcessForce(40.0, ((5, 20), (30, 59)))], ids=["gravity", "process"])
@pytest.mark.parametrize("name", MACHINES)
def test_posted_commands_come_back_to_the_last_digit(name, post, force, tmp_path):
    machine = MACHINES[name]
    program = program_of(machine, force=force)
    write_post(PostInput(program, machine), post, tmp_path, unverified=True)
    raw, back = read_post(tmp_path, post), read_post(tmp_path, post, machine)
    if find_post(post).readings:
        assert np.abs(raw.legs - program.legs).max() <= QUANTUM
        return
    assert np.abs(raw.legs - commanded(program, machine).legs).max() <= QUANTUM
    assert raw.provenance.commands
    assert np.abs(back.legs - program.legs).max() <= 2.0 * QUANTUM
    assert back.provenance == replace(program.provenance, unverified=True)


def test_a_process_force_pushes_back_against_the_motion():
    """In the middle of a long cut at constant speed the loads of the legs do the work of the force, and no other."""
    machine = MACHINES["springs"]
    count = 600
    tips = machine.work.centre + np.linspace(0.0, 0.03, count)[:, None] * [0.6, -0.8, 0.0]
    down = np.tile([0.0, 0.0, -1.0], (count, 1))
    legs = np.round(machine.robot.leg_lengths(tips + machine.tool_length * down, -down), 11)
    source = Provenance(machine.name, machine.digest, "", "1", compensation="gravity")
    plain = Program(1e-3, legs, "cubic", Component(1, 1), RigidTransform.identity(), source)
    cutting = replace(plain, process_force=ProcessForce(50.0, ((100, 499),)))
    more = commanded(cutting, machine).legs - commanded(plain, machine).legs
    rate = np.gradient(legs, 1e-3, axis=0)
    middle = slice(200, 400)
    springs = 1.0 / (1.0 / machine.stiffness.leg_stiffness + 1.0 / machine.stiffness.joint_stiffness)
    work = (more * springs * rate)[middle].sum(axis=1)  # the legs push the tool against the force of the process
    speed = 0.03 / (count - 1) / 1e-3
    np.testing.assert_allclose(work, 50.0 * speed, rtol=2e-3)
    edge = round(0.5 * SMOOTH_S / 1e-3) + 1
    assert not more[: 100 - edge].any()
    assert not more[500 + edge :].any()
    # It comes and goes without a corner: its acceleration is far below what legs may have.
    assert np.abs(np.diff(more, 2, axis=0)).max() / 1e-6 < 0.02 * machine.legs.max_acceleration.min()
    assert np.abs(np.diff(more, 3, axis=0)).max() / 1e-9 < 0.01 * machine.legs.max_jerk.min()
    both = joined(plain, replace(cutting, legs=legs + (legs[-1] - legs[0])))
    assert both.process_force.cuts == ((100 + len(both.legs) - count, 499 + len(both.legs) - count),)


@pytest.mark.parametrize("newtons", [50.0, 300.0, 1000.0])
@pytest.mark.parametrize("stiffness", [20e6, 2e6])
def test_commands_are_undone_where_the_tool_is_slow_and_yields_far(stiffness, newtons):
    """From rest, there and back to rest: near its ends the motion is slower than what the force takes off it."""
    machine = machine_of(stiffness=Stiffness(leg_stiffness=np.full(5, stiffness)))
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, 2.0 * np.pi, 900))[:, None]
    tips = machine.work.centre + 0.008 * share * [0.6, -0.7, 0.3]
    up = np.tile([0.0, 0.0, 1.0], (len(tips), 1))
    legs = np.round(machine.robot.leg_lengths(tips - machine.tool_length * up, up), 11)
    source = Provenance(machine.name, machine.digest, "", "1", compensation="gravity")
    cutting = ProcessForce(newtons, ((0, 899),))
    program = Program(1e-3, legs, "cubic", Component(1, 1), RigidTransform.identity(), source, process_force=cutting)
    told = commanded(program, machine)
    assert np.abs(told.legs - legs).max() > 5e-6
    assert np.abs(read_back(told, machine).legs - legs).max() < 2.5 * QUANTUM, "two last digits"
    said = compensation_sentence(program, machine)
    assert f"{newtons:g} N against the motion on cuts" in said
    # What cannot be compensated for at this speed is told.
    assert ("legs yield too far" in said) == (newtons / stiffness > 3e-6)


def test_a_row_without_a_pose_leaves_the_others_as_they_are():
    machine = MACHINES["springs"]
    program = program_of(machine, force=ProcessForce(40.0, ((5, 59),)))
    legs = program.legs.copy()
    legs[20] = 0.1
    made, usual = commanded(replace(program, legs=legs), machine).legs, commanded(program, machine).legs
    assert np.array_equal(made[20], legs[20])
    far = np.r_[0:5, 25:60]  # the speed at its neighbours is unknown, too
    assert np.abs(made[far] - usual[far]).max() < 1e-6


def test_another_stiffness_or_weight_cannot_undo_commands():
    machine = MACHINES["springs"]
    told = commanded(program_of(machine), machine)
    masses = replace(machine.masses, platform=machine.masses.platform + 1e-6)
    for other in (
        replace(machine, stiffness=Stiffness(leg_stiffness=np.full(5, 20e6))),
        replace(machine, masses=masses),
    ):
        with pytest.raises(InputError, match="another leg model, stiffness or weight"):
            read_back(told, other)
    with pytest.raises(MachineError, match="does not say how far they do"):
        commanded(program_of(machine), Machine.load("desk"))


@pytest.fixture(scope="module")
def soft_job(tmp_path_factory):
    """A folder with a machine of soft legs, a job on it, and its run."""
    folder = tmp_path_factory.mktemp("soft")
    text = (LIBRARY / "desk.toml").read_text(encoding="utf-8")
    assert "min_length_mm = 489\n" in text
    text = text.replace("min_length_mm = 489\n", "min_length_mm = 489\nstiffness_n_um = 20\n")
    (folder / "soft.toml").write_text(text, encoding="utf-8")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    job = folder / "job.toml"
    text = job_text().replace('name = "desk"', 'file = "soft.toml"').replace("stepover_mm = 15", "stepover_mm = 18")
    job.write_text(text, encoding="utf-8")
    assert run(["plan", str(job), "-o", str(folder / "out"), "-q"]) == 0
    return folder


def test_a_job_is_compensated_by_itself_and_its_posted_rows_are_judged(soft_job, tmp_path, capsys):
    program = read_csv(soft_job / "out" / "program.csv")
    assert program.provenance.compensation == "gravity"
    # What is left is in the report as the verdict says it.
    text = (soft_job / "out" / "report.html").read_text(encoding="utf-8")
    (row,) = (each for each in page_data(text)["plots"]["rows"] if each["title"].startswith("deflection of the tip"))
    claims = json.loads((soft_job / "out" / "verdict.json").read_text(encoding="utf-8"))["certificates"]
    (left,) = (1e3 * each["value"] for each in claims if each["claim"] == "deflection")
    assert page_arrays(text)[row["array"]].max() == pytest.approx(left, rel=0.02)  # the report's accelerations
    posted = tmp_path / "posted"
    assert run(["post", str(soft_job / "out" / "program.csv"), "--to", "csv", "-o", str(posted), "-q"]) == 0
    (file,) = posted.glob("*.csv")
    told = read_csv(file)
    assert 1e-6 < np.abs(told.legs - program.legs).max() < 1e-4
    capsys.readouterr()
    assert run(["verify", str(file), "--job", str(soft_job / "job.toml"), "--json"]) == 0
    said = capsys.readouterr().out
    assert "the rows are what drives are told" in said
    assert "drives compensate for the weight" in said
    # Both files, the program and what was posted of it, say where the tip is.
    tips = list[np.ndarray]()
    for each in (soft_job / "out" / "program.csv", file):
        assert run(["fk", "--program", str(each), "--job", str(soft_job / "job.toml")]) == 0
        rows = capsys.readouterr().out.splitlines()[1:]
        tips.append(np.array([row.split(",") for row in rows], dtype=np.float64))
        assert run(["simulate", str(each), "--job", str(soft_job / "job.toml"), "-q", "--within", "0.1"]) == 0
        assert run(["monitor", str(file), "--program", str(each), "--job", str(soft_job / "job.toml")]) == 0
        assert capsys.readouterr().out
    # They say the same, but for a rare leg that is rounded to the next 1e-8 mm; the tip moves by a few times as much.
    differ = np.abs(tips[0] - tips[1]).max(axis=1)
    assert np.mean(differ > 0.0) < 1e-3
    assert differ.max() < 5e-8
    # Judged on a machine with other springs they are somebody else's.
    text = (soft_job / "soft.toml").read_text(encoding="utf-8").replace("stiffness_n_um = 20", "stiffness_n_um = 21")
    other = tmp_path / "soft.toml"
    other.write_text(text, encoding="utf-8")
    job = tmp_path / "job.toml"
    job.write_text((soft_job / "job.toml").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "part.stl").write_bytes((soft_job / "part.stl").read_bytes())
    assert run(["verify", str(file), "--job", str(job)]) == 1
    assert "commands of another leg model, stiffness or weight" in capsys.readouterr().out
    # Nor are commands made by springs that no verdict knows.
    planned, late = str(soft_job / "out" / "program.csv"), tmp_path / "late"
    assert run(["post", planned, "--to", "pvt", "-o", str(late), "--job", str(job)]) == 2
    assert "stiffness or masses were changed after the verdict" in capsys.readouterr().err
    assert not late.exists()


def test_strokes_hold_for_what_drives_are_told(soft_job, tmp_path):
    """A leg that is just long enough under its load would have to be told less than its stroke."""
    job = Job.load(soft_job / "job.toml")
    machine, program = job_machine(job), read_csv(soft_job / "out" / "program.csv")
    told = commanded(program, machine)
    leg = int(np.argmin((told.legs - program.legs).min(axis=0)))
    assert (told.legs - program.legs)[:, leg].max() < 0.0, "a leg that is pulled"
    least = np.array(machine.legs.min_length)
    least[leg] = 0.5 * (program.legs[:, leg].min() + told.legs[:, leg].min())
    tight = replace(machine, legs=replace(machine.legs, min_length=least))
    for compensation, fails in (("gravity", True), ("", False)):
        other = replace(program, provenance=replace(program.provenance, compensation=compensation))
        file = write_csv(other, tmp_path / "program.csv")
        failed = {each.claim for each in judge(job, file, machine=tight).certificates if not each.passed}
        assert ("legs not too short" in failed) == fails


def test_the_set_up_sheet_tells_what_drives_count(soft_job):
    """At the pose of the first row, as a post tells the drives: not the length, which is micrometres off."""
    program = read_csv(soft_job / "out" / "program.csv")
    told = commanded(program, job_machine(Job.load(soft_job / "job.toml")))
    text = (soft_job / "out" / "sheet.html").read_text(encoding="utf-8")
    row = re.search(r"<th>start</th><td>[^<]*</td><td>([^<]*)</td>", text)
    assert row is not None
    shown = np.array([float(value) for value in row[1].split(",")])
    assert np.abs(shown - 1e3 * told.legs[0]).max() <= 0.6e-3
    assert np.abs(shown - 1e3 * program.legs[0]).max() > 2e-3


def test_compensation_is_asked_for_in_the_job(make_job):
    desk = Job.load(make_job())
    other = desk.with_(**{"output.compensation": "none"})
    assert other.digest != desk.digest
    with pytest.raises(JobError, match=r"output\.compensation: there is no process force"):
        job_machine(desk.with_(**{"output.compensation": "process"}))
    with pytest.raises(JobError, match=r"output\.compensation: how far the legs of this machine yield is not known"):
        job_machine(desk.with_(**{"output.compensation": "gravity"}))


def test_a_calibrated_machine_compensates_only_if_the_job_asks(make_job):
    """The calibration may have taken for geometry what legs yield to weight."""
    job = Job.load(make_job())
    soft = machine_of(stiffness=SOFT)
    robot = AsBuiltPentapod.of(soft.robot, radii=RINGS)
    geometry = MeasuredGeometry(robot.base, robot.offsets, robot.radii, robot.zeros)
    calibrated = replace(soft, robot=robot, calibration=CalibrationRecord("desk", "", date(2026, 1, 31), geometry))
    for asked, on in ((None, False), ("none", False), ("gravity", True)):
        assert is_compensated(job.with_(**{"output.compensation": asked}), calibrated) == on
        assert is_compensated(job.with_(**{"output.compensation": asked}), soft) == (asked != "none")
    said = compensation_sentence(program_of(calibrated, compensation=""), calibrated)
    assert said.startswith("drives do not compensate for the weight")
    assert compensation_sentence(program_of(soft, compensation=""), soft) == ""


def test_a_process_force_of_the_job_is_compensated_for_on_its_cuts(soft_job, tmp_path, capsys):
    text = (soft_job / "job.toml").read_text(encoding="utf-8")
    assert "[feed]\n" in text
    text = text.replace("[feed]\n", "[feed]\ncutting_force_n = 30\n") + '\n[output]\ncompensation = "process"\n'
    (soft_job / "process.toml").write_text(text, encoding="utf-8")
    out, posted = tmp_path / "out", tmp_path / "posted"
    assert run(["plan", str(soft_job / "process.toml"), "-o", str(out)]) == 0
    assert "weight and 30 N against the motion on cuts" in capsys.readouterr().out
    program = read_csv(out / "program.csv")
    assert program.process_force.newtons == 30.0
    assert len(program.process_force.cuts) > 3
    assert run(["post", str(out / "program.csv"), "--to", "csv", "-o", str(posted), "-q"]) == 0
    (file,) = posted.glob("*.csv")
    assert run(["verify", str(file), "--job", str(soft_job / "process.toml"), "-q"]) == 0
    assert run(["simulate", str(file), "--job", str(soft_job / "process.toml"), "-q", "--within", "0.1"]) == 0


@pytest.mark.slow
def test_legs_keep_their_limits_where_compensation_moves_them_too(soft_job, tmp_path):
    """Very soft legs and a large force: the first time law is made for the legs alone, and the drives would exceed."""
    machine = (soft_job / "soft.toml").read_text(encoding="utf-8")
    assert "stiffness_n_um = 20\n" in machine
    (tmp_path / "soft.toml").write_text(machine.replace("stiffness_n_um = 20\n", "stiffness_n_um = 2\n"))
    (tmp_path / "part.stl").write_bytes((soft_job / "part.stl").read_bytes())
    text = (soft_job / "job.toml").read_text(encoding="utf-8")
    assert "cut_mm_min = 3000\n" in text
    text = text.replace("cut_mm_min = 3000\n", "cut_mm_min = 6000\ncutting_force_n = 300\n")
    (tmp_path / "job.toml").write_text(text + '\n[output]\ncompensation = "process"\n')
    job, out = Job.load(tmp_path / "job.toml"), tmp_path / "out"
    assert run(["plan", str(tmp_path / "job.toml"), "-o", str(out), "-q"]) == 0
    limits, program = job_machine(job).legs, read_csv(out / "program.csv")
    told = commanded(program, job_machine(job)).legs
    for order, limit in ((2, limits.max_acceleration), (3, limits.max_jerk)):
        assert (np.abs(np.diff(told, order, axis=0)) / program.period**order <= 1.001 * limit).all()
    assert "the legs keep below their limits" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("newtons", "cuts", "compensation"),
    [
        (40.0, ((5, 5),), "gravity"),
        (40.0, (), "gravity"),
        (40.0, ((5, 60),), "gravity"),
        (-3.0, ((5, 8),), "gravity"),
        (np.nan, ((5, 8),), "gravity"),
        (40.0, ((5, 8),), ""),
    ],
)
def test_a_program_has_no_process_force_that_its_file_could_not_say(newtons, cuts, compensation):
    with pytest.raises(ProgramError):
        program_of(MACHINES["springs"], compensation, ProcessForce(newtons, cuts))
