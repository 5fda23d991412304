"""The real pentakins of LinuxCNC: the same machine, rings and all. Skipped without its files."""

import numpy as np

from linuxcnc_kinematics import asked, called, pointing
from pentapod.kinematics import AsBuiltPentapod, LinearPentapod, as_built_pose

pytestmark = called

NOMINAL = LinearPentapod.quadratic(
    0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)]), 0.5
)


def poses(rng, n):
    return rng.uniform((-0.2, -0.2, 0.4), (0.2, 0.2, 0.8), (n, 3)), rng.uniform(-25.0, 25.0, (n, 2))


def test_pentakins_agrees(tmp_path):
    rng = np.random.default_rng(0)
    machine = AsBuiltPentapod.of(
        NOMINAL,
        base_errors=rng.normal(size=(5, 3)) * 1e-3,
        offset_errors=rng.normal(size=5) * 1e-3,
        radii=[0.0, 0.002, 0.005, 0.001, 0.008],
    )
    p, tilts = poses(rng, 500)
    theirs, position, direction = asked(machine, p, tilts, tmp_path)
    legs = machine.leg_lengths(p, pointing(tilts))
    assert np.abs(legs - theirs).max() < 2e-15
    found = as_built_pose(machine, NOMINAL, legs, (1, 1))
    assert found.proven.mean() > 0.99
    sure = found.proven
    assert np.abs(found.position - position)[sure].max() < 1e-9
    assert np.abs(found.direction - direction)[sure].max() < 1e-9


def test_pentakins_agrees_with_the_closed_form(tmp_path):
    """On the linear pentapod itself, all rings of radius 0: legs, and Newton's poses against the closed form."""
    p, tilts = poses(np.random.default_rng(1), 500)
    theirs, position, direction = asked(AsBuiltPentapod.of(NOMINAL), p, tilts, tmp_path)
    assert np.abs(NOMINAL.leg_lengths(p, pointing(tilts)) - theirs).max() < 1e-9
    ours = NOMINAL.pose(theirs, (1, 1))
    assert np.abs(ours[0] - position).max() < 1e-9
    assert np.abs(ours[1] - direction).max() < 1e-9
