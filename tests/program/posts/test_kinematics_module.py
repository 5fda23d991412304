"""The kinematics module for LinuxCNC: its mathematics against the robots' own, its guard, its compilation."""

from __future__ import annotations

import dataclasses
import subprocess
from pathlib import Path

import numpy as np
import pytest

from compiled_kinematics import (
    COMPILER,
    MARGINS,
    STRICT,
    Compiled,
    calibrated,
    compiled,
    poses,
    random_machine,
    world_of,
)
from pentapod.base.errors import MachineError
from pentapod.cli.main import run
from pentapod.kinematics import AsBuiltPentapod
from pentapod.kinematics.component import COMPONENTS
from pentapod.machine import Machine
from pentapod.machine.leg_model import LegModel
from pentapod.planning.limits.margins import Margins
from pentapod.program.posts.linuxcnc.kinematics import kinematics_files

MM = 1e3
MACHINES = {
    "desk": lambda: Machine.load("desk"),
    "random 1": lambda: random_machine(1),
    "random 2": lambda: random_machine(2),
    "calibrated": lambda: calibrated(3),
    "calibrated with rings": lambda: calibrated(4, 0.012),
}


def compared(machine: Machine, module: Compiled, count: int, seed: int = 0) -> dict[str, float]:
    """Largest differences from the robot, mm and 1; how many of the poses that it finds were not found, or wrong."""
    p, i = poses(machine, count, seed)
    legs = MM * machine.robot.leg_lengths(p, i)
    ours, _ = module.inverses(world_of(machine, p, i))
    found = module.lines(legs)
    off = np.abs(found[:, :3] - MM * p).max(axis=1)
    missing, unstarted = np.isnan(off), np.zeros(len(p), dtype=bool)
    if isinstance(machine.robot, AsBuiltPentapod) and machine.robot.radii.any():
        # With rings the design may have no pose of these readings: then nothing says which pose is meant.
        unstarted = np.isnan(machine.robot.pose(1e-3 * legs, COMPONENTS[0])[0][:, 0])
    return {
        "legs": float(np.abs(ours - legs).max()), "point": float(np.nanmax(off)),
        "axis": float(np.nanmax(np.abs(found[:, 3:] - i))), "missing": int((missing & ~unstarted).sum()),
        "wrong": int((off[~missing] > 1e-6).sum()),
    }  # fmt: skip


@compiled
@pytest.mark.parametrize("name", MACHINES)
def test_header_computes_what_the_robot_does(name, tmp_path):
    machine = MACHINES[name]()
    found = compared(machine, Compiled(machine, tmp_path), 3000)
    assert found["legs"] < 1e-9
    assert found["point"] < 1e-8
    assert found["axis"] < 1e-11
    assert found["wrong"] == 0
    assert found["missing"] <= (0.005 * 3000 if "rings" in name else 0)


@compiled
@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_none_of_a_million_cold_starts_is_wrong(name, tmp_path):
    machine = MACHINES[name]()
    module = Compiled(machine, tmp_path)
    for seed in range(5):
        found = compared(machine, module, 200_000, seed + 1)
        assert found["legs"] < 1e-9
        assert found["point"] < 1e-8
        assert found["wrong"] == 0
        assert found["missing"] <= (0.005 * 200_000 if "rings" in name else 0)


@compiled
@pytest.mark.parametrize("name", MACHINES)
def test_margins_are_those_of_the_planner(name, tmp_path):
    machine = MACHINES[name]()
    p, i = poses(machine, 2000)
    _, margins = Compiled(machine, tmp_path).inverses(world_of(machine, p, i))
    planner = Margins.of(machine, COMPONENTS[0])
    own = planner.own(p + machine.tool_length * i, -i) * [limit.comfort for limit in planner.own_limits]
    kinds = (
        ("w = 0", 1.0), ("S = 0", MM), ("too ", MM), ("base joint", 1.0), ("platform joint", 1.0),
        ("legs ", MM), ("spindle", MM),
    )  # fmt: skip
    for k, (words, unit) in enumerate(kinds):
        columns = [c for c, limit in enumerate(planner.own_limits) if words in limit.name]
        assert columns
        assert np.abs(unit * own[:, columns].min(axis=1) - margins[:, k]).max() < 1e-8, MARGINS[k]


@compiled
def test_no_pose_has_impossible_legs(tmp_path):
    beyond = np.array([[900.0, 490, 900, 490, 900], [np.nan] * 5, [1.0] * 5])
    for name, machine in (("desk", Machine.load("desk")), ("calibrated", calibrated(3, 0.03))):
        assert np.isnan(Compiled(machine, tmp_path / name).lines(beyond)).all()


@compiled
@pytest.mark.parametrize("pace", [0.02, 0.2, 0.5, 1.0])
def test_feed_is_what_keeps_the_legs_in_their_rates_at_the_speed_that_is_asked_for(tmp_path, pace):
    """So slowing down does not end between both: a leg 2.2 times too fast would stay 1.5 times too fast."""
    machine = Machine.load("desk")
    world = np.linspace(0.0, 1.0, 200)[:, None] * [60.0, 40.0, 0.0, 0.0, 0.0]
    module = Compiled(machine, tmp_path)
    legs, _ = module.inverses(world)
    _, feed = module.guarded(legs, True, pace, np.full(7, -np.inf), np.full(5, 1e9))
    rates = np.abs(np.diff(legs, axis=0) / 1e-3 / (MM * machine.legs.max_velocity)).max(axis=1)
    # As slow as this, at the beginning of a motion, its share of the speed is not known well.
    expected = np.ones(199) if pace == 0.02 else np.minimum(1.0, pace / rates)
    assert feed[0] == 1.0
    assert np.abs(feed[1:] - expected).max() < 1e-9
    assert (expected < 1.0).all() == (pace in (0.2, 0.5))


@compiled
def test_feed_falls_back_on_what_is_too_fast_now_where_the_speeds_are_not_connected(tmp_path):
    machine = Machine.load("desk")
    module = Compiled(machine, tmp_path)
    legs, _ = module.inverses(np.linspace(0.0, 1.0, 100)[:, None] * [120.0, 80.0, 0.0, 0.0, 0.0])
    _, feed = module.guarded(legs, True, -1.0, np.full(7, -np.inf), np.full(5, 1e9))
    rates = np.abs(np.diff(legs, axis=0) / 1e-3 / (MM * machine.legs.max_velocity)).max(axis=1)
    assert rates.min() > 1.5
    assert np.abs(feed[1:] - 1.0 / rates).max() < 1e-9


@compiled
def test_world_comes_back(tmp_path):
    machine = calibrated(5)
    module = Compiled(machine, tmp_path)
    world = world_of(machine, *poses(machine, 500))
    legs, _ = module.inverses(world)
    assert np.abs(module.worlds(legs) - world).max() < 1e-8


@compiled
def test_other_components_are_found_where_their_poses_keep_the_cones(tmp_path):
    machine = Machine.load("desk")
    p, i = poses(machine, 60_000)
    legs = machine.robot.leg_lengths(p, i)
    every, directions = machine.robot.assembly_modes(legs)
    expected = np.zeros(len(legs), dtype=int)
    for mode in range(1, 4):
        vectors = machine.robot.leg_vectors(every[:, mode], directions[:, mode]) / legs[..., None]
        base = np.einsum("nkc,kc->nk", vectors, machine.joints.base_axes) - np.cos(machine.joints.base_cone)
        cosine = np.einsum("nkc,nc->nk", vectors, directions[:, mode])
        low, high = np.cos(machine.joints.platform_range[:, 1]), np.cos(machine.joints.platform_range[:, 0])
        expected += (base.min(axis=1) > 0.0) & ((cosine > low) & (cosine < high)).all(axis=1)
    module = Compiled(machine, tmp_path)
    found = module.others(MM * legs, 0.0)
    assert 0 < (expected > 0).sum() < 0.05 * len(legs)
    np.testing.assert_array_equal(found, expected)
    assert (module.others(MM * legs, 0.01) >= expected).all()


def jog(start: np.ndarray, axis: int, speed: float, fast: float, stop_at: int | None, count: int) -> np.ndarray:
    """Worlds (count, 5), a millisecond apart, of a jog that gets faster, and from a period on slower, by `fast`."""
    here, rate, rows = start.copy(), 0.0, []
    for k in range(count):
        target = 0.0 if stop_at is not None and k >= stop_at else speed
        rate += float(np.clip(target - rate, -1e-3 * fast, 1e-3 * fast))
        here = here.copy()
        here[axis] += 1e-3 * rate
        rows.append(here)
    return np.array(rows)


@compiled
def test_guard_stops_jogs_before_every_limit_and_lets_them_back(tmp_path):
    """Jogs of all axes both ways from random poses, with the delay of three periods that LinuxCNC has."""
    machine = Machine.load("desk")
    module = Compiled(machine, tmp_path)
    least, fast = np.array([0.1, 20.0, 0.0, 0.0, 0.0, 1.0, 1.0]), np.array([1000.0] * 3 + [289.4] * 2)
    starts = world_of(machine, *poses(machine, 4000))
    _, margins = module.inverses(starts)
    starts = starts[(margins > least + 0.05).all(axis=1)][:3]
    limits: set[int] = set()
    for start in starts:
        for axis in range(5):
            for speed in (200.0, -200.0) if axis < 3 else (28.9, -28.9):
                free = jog(start, axis, speed, fast[axis], None, 5000)
                told = module.guards(module.inverses(free)[0], False, least, fast)
                assert told[:, 0].all() or not told[0, 1]
                stop = int(np.argmax(told[:, 1]))
                assert told[stop, 1], (start, axis, speed)
                way = jog(start, axis, speed, fast[axis], stop + 3, stop + 400)
                legs, margins = module.inverses(way)
                left = margins.min(axis=0) - least
                assert (margins >= least).all(), (start, axis, speed, left.min())
                limits.add(int(np.argmin((margins[-1] - least) / [1, 100, 100, 1, 1, 100, 100])))
                assert np.abs(np.diff(legs, 2, axis=0)).max() < 5000e-6
                back = jog(way[-1], axis, -speed, fast[axis], None, 30)
                assert not module.guards(module.inverses(back)[0], False, least, fast)[:, 1].any()
    assert len(limits) >= 3


@compiled
def test_hold_of_a_program_is_kept_until_it_is_aborted(tmp_path):
    machine = Machine.load("desk")
    module = Compiled(machine, tmp_path)
    least, fast = np.array([0.1, 20.0, 0.0, 0.0, 0.0, 1.0, 1.0]), np.array([1000.0] * 3 + [289.4] * 2)
    way = jog(np.zeros(5), 2, 150.0, 1000.0, 1720, 3000)  # towards S = 0, then at rest
    legs = module.inverses(way)[0]
    held, jogged = module.guards(legs, True, least, fast), module.guards(legs, False, least, fast)
    first = int(np.argmax(held[:, 2]))
    assert first > 0
    assert held[first:, 2].all()
    assert not jogged[:, 2].any()
    assert not jogged[-1, 1]


@compiled
def test_shells_compile_without_a_warning(tmp_path):
    """For 2.9 against LinuxCNC's own headers where they are, for the development branch against a stand-in."""
    for name, content in kinematics_files(calibrated(3, 0.01), COMPONENTS[0], 1e-3).items():
        (tmp_path / name).write_bytes(content)
    own = Path("/usr/include/linuxcnc")
    stand_in = Path(__file__).parents[2] / "linuxcnc_headers"
    ways = [("pins_dev.h", stand_in)]
    ways += [("pins_2.9.h", own)] if (own / "kinematics.h").exists() else []
    for pins, headers in ways:
        (tmp_path / "pentapod_pins.h").write_bytes((tmp_path / pins).read_bytes())
        words = [COMPILER, "-std=gnu99", *STRICT[1:], "-D_GNU_SOURCE", "-DRTAPI", "-DUSPACE", "-isystem", str(headers)]
        for source in ("pentapod_kins.c", "pentapod_contour.c"):
            done = subprocess.run(
                [*words, "-c", source], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
            )
            assert done.returncode == 0, (pins, done.stderr)


def test_module_names_its_machine(tmp_path):
    machine = calibrated(3)
    files = kinematics_files(machine, COMPONENTS[0], 1e-3)
    header, readme = files["pentapod_kinematics.h"].decode(), files["README.md"].decode()
    assert f"#define PENTAPOD_DIGEST_HIGH 0x{machine.digest[:8]}u" in header
    assert f"#define PENTAPOD_DIGEST_LOW 0x{machine.digest[8:]}u" in header
    assert machine.digest in readme
    assert not any(b"@" in content for name, content in files.items() if name.endswith((".h", ".c", ".md")))
    assert files == kinematics_files(machine, COMPONENTS[0], 1e-3)


def test_machine_command_writes_the_module(tmp_path, capsys):
    assert run(["machine", "linuxcnc", "desk", "-o", str(tmp_path / "hand")]) == 0
    assert "kinematics module and simulation of desk" in capsys.readouterr().out
    expected = kinematics_files(Machine.load("desk"), COMPONENTS[0], 1e-3)
    assert {file.name: file.read_bytes() for file in (tmp_path / "hand").iterdir()} == expected
    assert run(["machine", "linuxcnc", "hexa", "-o", str(tmp_path / "none")]) == 2
    assert "no kinematics module for such a machine" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("name", ["bench-general", "hexa", "spr", "prpu"])
def test_other_families_have_no_module(name):
    machine = Machine.load(name)
    with pytest.raises(MachineError, match=r"no kinematics module for such a machine.*stream"):
        kinematics_files(machine, machine.robot.branches[0], 1e-3)


def test_drives_that_are_told_other_numbers_have_no_module():
    machine = dataclasses.replace(Machine.load("desk"), leg_model=LegModel(backlash=1e-5))
    with pytest.raises(MachineError, match="drives are told something else"):
        kinematics_files(machine, COMPONENTS[0], 1e-3)
