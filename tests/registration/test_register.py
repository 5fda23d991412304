"""Registration against forged touches: the part is found, what is open is named, outliers and twins are."""

from pathlib import Path

import numpy as np
import pytest
from forged_touches import RADIUS, free, moved, revolved, sheet, sphere, touched

from pentapod.geometry import RigidTransform
from pentapod.mesh import Mesh, load_mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.registration import CutSurface, NotRegistered, register

ROOT = Path(__file__).parents[2]
HERE = RigidTransform.identity()
NOISE = 5e-6


def cut_of(mesh, facets):
    rows = np.flatnonzero(facets)[:: max(1, int(facets.sum()) // 400)]
    return CutSurface(mesh.vertices[mesh.faces[rows]].reshape(-1, 3), np.repeat(mesh.facet_normals[rows], 3, axis=0))


def found(mesh, facets, seed, count=40, noise=NOISE, **options):
    """What is found of a part that is 2 mm and 2 degrees off, and by how much its surface is then off along normals."""
    truth, rng = moved(seed), np.random.default_rng(1000 + seed)
    centres = truth.apply(touched(mesh, facets, count, seed)) + noise * rng.normal(size=(count, 3))
    cut = cut_of(mesh, facets)
    answer = register(MeshDistance.of(mesh), centres, RADIUS, HERE, cut, **options)
    result = answer.found if isinstance(answer, NotRegistered) else answer
    off = result.placement.apply(cut.points) - truth.apply(cut.points)
    return answer, np.abs((off * truth.rotate(cut.normals)).sum(axis=1)).max()


def waves(x, y):
    return 3e-3 * np.sin(120.0 * x) * np.cos(90.0 * y) + 0.1 * x * y


@pytest.mark.parametrize(
    "height",
    [waves, pytest.param(lambda x, y: 10.0 * (x * x - y * y), marks=pytest.mark.slow)],
    ids=["waves", "saddle"],
)
def test_forty_touches_find_the_surface_within_ten_micrometres(height) -> None:
    mesh, errors = sheet(height), []
    for seed in range(3):
        answer, error = found(mesh, np.ones(len(mesh.faces)), seed)
        assert not isinstance(answer, NotRegistered)
        assert error <= 2.0 * answer.uncertainty
        assert answer.outliers == ()
        assert answer.others == ()
        errors.append(error)
    assert np.median(errors) <= 10e-6


def block(step=0.0):
    """A block; step: of a corner that is cut off its top."""
    low, high = np.array([-0.04, -0.03, -0.02]), np.array([0.04, 0.03, 0.02])
    corners = np.array([[(low, high)[k >> 2][0], (low, high)[k >> 1 & 1][1], (low, high)[k & 1][2]] for k in range(8)])
    corners[7] -= step * np.array([0.0, 0.0, 1.0])
    sides = [(0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 4, 5), (0, 5, 1)]
    sides += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
    return Mesh.of(corners, np.array(sides))


PROFILE = [(0.03, 0.0), (0.028, 0.01), (0.02, 0.018), (0.018, 0.03), (0.01, 0.034)]
SYMMETRIC = {
    "sphere": (sphere(16), "all", ["through the point (0, 0, 0) mm"] * 3),
    "cap": (sphere(24), "top", ["through the point"] * 3),
    "cylinder": (revolved([(0.03, 0.0), (0.03, 0.08)], 48), "all", ["along z", "a shift along z"]),
    "cone": (revolved([(0.03, 0.0), (0.005, 0.06)], 48), "all", ["along z"]),
    "turned part": (revolved(PROFILE, 48), "all", ["along z"]),
    "plane": (block(), "top", ["a shift along x", "a shift along y", "along z"]),
    "two sides of a block": (block(), "xz", ["a shift along y"]),
    "extruded": (sheet(lambda x, y: 4e-3 * np.sin(100.0 * x)), "all", ["a shift along y"]),
}


QUICK = ("sphere", "cylinder", "extruded")


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in SYMMETRIC])
def test_motions_that_touches_leave_open_are_named(name) -> None:
    mesh, where, names = SYMMETRIC[name]
    n = mesh.facet_normals
    facets = {"all": n[:, 2] > -2.0, "top": n[:, 2] > 0.6, "xz": (n[:, 2] > 0.9) | (n[:, 0] > 0.9)}[where]
    answer, _ = found(mesh, facets.astype(float), 3)
    assert isinstance(answer, NotRegistered)
    open_ = [motion.name for motion in answer.found.held]
    assert len(open_) == len(names)
    for part in names:
        assert any(part in name for name in open_), (part, open_)
    held, error = found(mesh, facets.astype(float), 3, hold=True)
    assert not isinstance(held, NotRegistered)
    assert error < 60e-6 or "point" in names[0]
    if "point" in names[0]:  # facets of a sphere that was turned are elsewhere, its centre is not
        assert np.linalg.norm(held.placement.translation - moved(3).translation) < 60e-6


def test_outliers_are_named_and_not_used() -> None:
    mesh = sheet(waves)
    truth = moved(5)
    centres = touched(mesh, np.ones(len(mesh.faces)), 40, 5)
    normals = mesh.facet_normals.mean(axis=0)
    centres[[4, 17, 30]] += np.array([[0.5e-3], [-0.4e-3], [0.1e-3]]) * normals
    centres = truth.apply(centres) + NOISE * np.random.default_rng(0).normal(size=centres.shape)
    answer = register(MeshDistance.of(mesh), centres, RADIUS, HERE, cut_of(mesh, np.ones(len(mesh.faces))))
    assert answer.outliers == (4, 17, 30)
    assert answer.rms < 1.5 * NOISE


def test_two_placements_that_fit_are_said() -> None:
    """A block touched on its sides and below: only a corner of its top tells it from itself turned by 180 degrees."""
    mesh = block(step=5e-3)
    n = mesh.facet_normals
    sides = (np.abs(n[:, 0]) > 0.9) | (np.abs(n[:, 1]) > 0.9)
    centres = [c for c in touched(mesh, sides.astype(float), 60, 1) if abs(c[2]) < 0.012]
    floor = touched(mesh, (n[:, 2] < -0.9).astype(float), 12, 1)
    centres = np.concatenate([np.array(centres), floor])
    cut = cut_of(mesh, n[:, 2] > 0.5)
    near = register(MeshDistance.of(mesh), moved(2).apply(centres), RADIUS, HERE, cut)
    assert not isinstance(near, NotRegistered)
    assert [f"{np.degrees(other.turn):.0f}" for other in near.others] == ["180"]
    turned = RigidTransform(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.zeros(3))
    far = register(MeshDistance.of(mesh), centres, RADIUS, turned, cut)
    assert isinstance(far, NotRegistered)
    assert "fit two placements" in str(far)


def test_touches_of_another_part_are_refused() -> None:
    other, mesh = sheet(lambda x, y: 40.0 * x * y), sheet(waves)
    answer = register(
        MeshDistance.of(mesh), touched(other, np.ones(len(other.faces)), 40, 0), RADIUS, HERE,
        cut_of(mesh, np.ones(len(mesh.faces))), noise=NOISE,
    )  # fmt: skip
    assert isinstance(answer, NotRegistered)
    assert "no placement fits" in str(answer)


@pytest.mark.slow
@pytest.mark.parametrize(("part", "limit"), [("saddle", 10e-6), ("wavy", 10e-6), ("dome", None)])
def test_shipped_parts(part, limit) -> None:
    mesh = load_mesh(ROOT / "toolpaths" / f"{part}.stl", "mm")
    facets = (mesh.facet_normals[:, 2] > 0.2).astype(float)
    errors = []
    for seed in range(8):
        answer, error = found(mesh, facets, seed)
        errors.append(error)
        assert isinstance(answer, NotRegistered) == (limit is None)
    assert limit is None or np.median(errors) <= limit


def test_the_forging_sees_balls_that_cut_the_part() -> None:
    assert free(block(), np.array([0.0, 0.0, 0.02 + RADIUS]), RADIUS)
    assert not free(block(), np.array([0.0, 0.0, 0.02 + 0.9 * RADIUS]), RADIUS)
