"""Forces of the drives in machine files: what they mean, that they belong to the machine's digest, and the errors."""

from importlib import resources

import numpy as np
import pytest

from pentapod.base.errors import InputError, MachineError
from pentapod.cli.commands.new import dome_stl
from pentapod.job import Job
from pentapod.job.build.values import job_machine
from pentapod.machine import Machine, read_machine
from usual_job import job_text

DESK = (resources.files("pentapod.machine") / "library" / "desk.toml").read_text(encoding="utf-8")


def desk(drives: str = "", more: str = "") -> Machine:
    return read_machine(f"{DESK}\n[drives]\n{drives}\n{more}", "my.toml")


def test_masses_and_drives_belong_to_the_digest_where_a_peak_force_is_given() -> None:
    plain = read_machine(DESK, "desk.toml")
    assert plain.digest == Machine.load("desk").digest == desk("moving_mass_kg = 30").digest
    one = desk("peak_force_n = 900")
    others = [
        desk("peak_force_n = 901"),
        desk("peak_force_n = 900\ncontinuous_force_n = 400"),
        desk("peak_force_n = 900\nmoving_mass_kg = 30"),
        desk("peak_force_n = 900\ncoulomb_friction_n = 5"),
        desk("peak_force_n = 900", "[masses]\nrod_kg = 1"),
    ]
    assert len({plain.digest, one.digest, *(machine.digest for machine in others)}) == 7
    assert one.digest == desk("peak_force_n = [900, 900, 900, 900, 900]").digest


def test_a_drive_has_its_peak_force_to_the_knee_and_none_at_the_no_load_velocity() -> None:
    forces = desk(
        "peak_force_n = [900, 900, 900, 900, 600]\nknee_velocity_mm_s = 200\nno_load_velocity_mm_s = 700\n"
        "coulomb_friction_n = 20\nviscous_friction_n_s_m = 100"
    ).drive_forces
    rates = np.outer([0.0, 0.2, -0.45, 0.7], np.ones(5))
    np.testing.assert_allclose(forces.available(rates)[:, 0], [900.0, 900.0, 450.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(forces.available(rates)[:, 4], [600.0, 600.0, 300.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(forces.friction(rates)[:, 0], [20.0, 40.0, 65.0, 90.0])
    assert np.isinf(desk("peak_force_n = 900").drive_forces.continuous_force).all()


@pytest.mark.parametrize(
    ("drives", "key"),
    [
        ("peak_force_n = 0", "drives.peak_force_n"),
        ("continuous_force_n = 300", "drives.peak_force_n"),
        ("peak_force_n = 200\ncontinuous_force_n = 300", "drives.peak_force_n"),
        ("peak_force_n = 200\ncoulomb_friction_n = -1", "drives.coulomb_friction_n"),
        ("peak_force_n = 200\nknee_velocity_mm_s = 300\nno_load_velocity_mm_s = 300", "drives.no_load_velocity_mm_s"),
        ("peak_force_n = [1, 2]", "drives.peak_force_n"),
    ],
)
def test_wrong_forces_are_one_line_with_their_key(drives: str, key: str) -> None:
    with pytest.raises(MachineError, match=key) as caught:
        desk(drives)
    assert "\n" not in str(caught.value)


def test_forces_are_not_for_machines_with_arms() -> None:
    hexa = (resources.files("pentapod.machine") / "library" / "hexa.toml").read_text(encoding="utf-8")
    with pytest.raises(MachineError, match=r"peak_force_n.*end on the tool's line"):
        read_machine(f"{hexa}\n[drives]\npeak_force_n = 900\n", "hexa.toml")


def test_a_cutting_force_needs_drives_with_a_force(tmp_path) -> None:
    text = job_text().replace("[feed]\n", "[feed]\ncutting_force_n = 30\n")
    assert "cutting_force_n" in text
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=4))
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    job = Job.load(tmp_path / "job.toml")
    with pytest.raises(InputError, match=r"feed\.cutting_force_n.*says nothing of the force of its drives"):
        job_machine(job)
    strong = desk("peak_force_n = 900")
    assert job_machine(job, strong).cutting_force == 30.0
    assert job_machine(job, strong).digest != strong.digest


def test_a_bound_on_the_deflection_needs_legs_with_a_stiffness(tmp_path) -> None:
    text = job_text().replace("[feed]\n", "[feed]\ncutting_force_n = 30\n")
    text = text.replace("[tolerance]\n", "[tolerance]\ndeflection_mm = 0.05\n")
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=4))
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    job = Job.load(tmp_path / "job.toml")
    with pytest.raises(InputError, match=r"tolerance\.deflection_mm.*not known on this machine"):
        job_machine(job, desk("peak_force_n = 900"))
    elastic = read_machine(DESK.replace("min_length_mm", "stiffness_n_um = 20\nmin_length_mm"), "my.toml")
    assert job_machine(job, elastic).cutting_force == 30.0
    assert job_machine(job, elastic).digest == elastic.digest  # no program depends on it
