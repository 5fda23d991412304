"""The cell decomposition: the paper's counts, exact ranks over the rationals, closures by approach, Euler's number."""

from fractions import Fraction

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.kinematics import COMPONENTS, LinearPentapod
from pentapod.theory import cell_decomposition, cell_of, poses_in_cell

BASE = np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
DELTAS = (Fraction(1, 2), Fraction(1), Fraction(5, 3), Fraction(-1, 2), Fraction(-1), Fraction(-5, 3))
PAPER_COUNTS = {"|δ| < 1": (4, 6, 2, 1, 0), "|δ| = 1": (4, 6, 6, 2, 1), "|δ| > 1": (4, 8, 8, 2, 1)}


def pentapod_of(delta: Fraction, *, shifted: bool = False) -> LinearPentapod:
    if not shifted:
        return LinearPentapod.quadratic(BASE, float(delta))
    return LinearPentapod.from_offsets(0.2 * BASE + (0.31, -0.17), 0.05 + float(delta) * 0.2 * BASE[:, 0], float(delta))


@pytest.mark.parametrize("delta", DELTAS)
def test_the_papers_counts(delta: Fraction) -> None:
    cells = cell_decomposition(float(delta))
    assert cells.counts(paper=True) == PAPER_COUNTS[cells.kind]
    assert sum(cells.counts()) == len(cells.cells)
    for a, cell in enumerate(cells.cells):
        assert [cells.cells[k].dimension for k in cells.boundary(a)] == sorted(
            (cells.cells[k].dimension for k in cells.boundary(a)), reverse=True
        )
        assert all(cells.cells[k].dimension < cell.dimension for k in cells.boundary(a))


@pytest.mark.parametrize("delta", DELTAS)
def test_the_diagram_of_one_component(delta: Fraction) -> None:
    """Fig. 5: each component has the paper's types of cells in its boundary, and the four are alike."""
    cells = cell_decomposition(float(delta))
    kinds = []
    for component in range(4):
        inside = [cells.cells[k] for k in cells.boundary(component) if cells.cells[k].in_paper]
        kinds.append(sorted(cell.equations for cell in inside))
    assert all(kind == kinds[0] for kind in kinds) or cells.kind != "|δ| = 1"
    if cells.kind == "|δ| = 1":
        expected = {("w = 0",), ("S = 0",), ("w = 0", "δu = 1"), ("w = 0", "pz = 0")}
        expected |= {("w = 0", "pz = 0", "δu = 1"), ("w = 0", "pz = 0", "px = 0", "δu = 1")}
        assert set(kinds[0]) == expected


def test_incidence_is_an_order() -> None:
    for delta in DELTAS:
        inside = cell_decomposition(float(delta)).incidence.astype(int)
        assert not np.diag(inside).any()
        assert not (inside & inside.T).any()
        assert ((inside @ inside > 0) <= (inside > 0)).all()  # what bounds a bounding cell bounds, too


@pytest.mark.parametrize("delta", DELTAS)
def test_the_alternating_sum_is_that_of_configuration_space(delta: Fraction) -> None:
    """R³ × S² has Euler characteristic (compact support) −2; the paper's cells alone miss it."""
    decomposition = cell_decomposition(float(delta))

    def euler(cell) -> int:
        whole_circle = cell.signs[0] == 0 and decomposition.kind == "|δ| < 1"  # w = 0, any heading: a circle, 0
        return 0 if whole_circle else (-1) ** cell.dimension * cell.sheets

    assert sum(euler(cell) for cell in decomposition.cells) == -2
    assert sum(euler(cell) for cell in decomposition.cells if cell.in_paper) != -2


def rational_directions(delta: Fraction, tilt: int | None, w: int) -> list[tuple[Fraction, ...]]:
    """Unit vectors with rational coordinates, the sign of w, and on w = 0 the sign of 1 − δu."""
    found = []
    for a in range(-3, 4):
        for b in range(-3, 4):
            n = Fraction(a * a + b * b + 1)
            found += [(2 * a / n, 2 * b / n, side * (a * a + b * b - 1) / n) for side in (1, -1)]
    found += [
        (u, v, Fraction(0))
        for s, t, r in ((3, 4, 5), (5, 12, 13), (0, 1, 1), (1, 0, 1))
        for u in (Fraction(s, r), -Fraction(s, r))
        for v in (Fraction(t, r), -Fraction(t, r))
    ]
    sign = lambda value: (value > 0) - (value < 0)  # noqa: E731
    return [i for i in found if sign(i[2]) == w and (tilt is None or sign(1 - delta * i[0]) == tilt)]


def exact_rank(rows: list[list[Fraction]]) -> int:
    rows, rank = [row[:] for row in rows], 0
    for column in range(len(rows[0])):
        pivot = next((k for k in range(rank, len(rows)) if rows[k][column] != 0), None)
        if pivot is None:
            continue
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        for k in range(rank + 1, len(rows)):
            factor = rows[k][column] / rows[rank][column]
            rows[k] = [x - factor * y for x, y in zip(rows[k], rows[rank], strict=True)]
        rank += 1
    return rank


def leg_matrix(delta: Fraction, p: list[Fraction], i: tuple[Fraction, ...]) -> list[list[Fraction]]:
    """Wrenches [d, b × d] of the lines of the legs about the origin: six columns, no tangent frame, no normalising."""
    rows = []
    for x, y in BASE.tolist():
        a = [Fraction(x), Fraction(y), Fraction(0)]
        b = [p[k] + delta * a[0] * i[k] for k in range(3)]
        d = [b[k] - a[k] for k in range(3)]
        rows.append([*d, b[1] * d[2] - b[2] * d[1], b[2] * d[0] - b[0] * d[2], b[0] * d[1] - b[1] * d[0]])
    return rows


@pytest.mark.parametrize("most", [10, pytest.param(40, marks=pytest.mark.slow)])
@pytest.mark.parametrize("delta", DELTAS)
def test_ranks_and_names_of_exact_poses(delta: Fraction, most: int) -> None:
    """In every cell poses with rational numbers that satisfy its equations exactly have its rank and bear its name."""
    decomposition, pentapod = cell_decomposition(float(delta)), pentapod_of(delta)
    rng = np.random.default_rng(41)
    for index, cell in enumerate(decomposition.cells):
        w, s, z, x, tilt = cell.signs
        tried = 0
        for i in rational_directions(delta, tilt if w == 0 else None, w or 0)[:most]:
            p = [Fraction(int(n), 7) for n in rng.integers(1, 40, size=3) * rng.choice((-1, 1), size=3)]
            p[2] = p[2] if z is None else z * abs(p[2])
            p[0] = p[0] if x is None else x * abs(p[0])
            if w and s is not None:
                height = s * Fraction(int(rng.integers(1, 20)), 3)
                p[0] = (height - (1 - delta * i[0]) * p[2]) / (delta * i[2])
            assert exact_rank(leg_matrix(delta, p, i)) == cell.rank
            assert cell_of(pentapod, [float(c) for c in p], [float(c) for c in i]) == index
            tried += 1
        assert tried >= 2, str(cell)


@pytest.mark.parametrize("shifted", [False, True])
@pytest.mark.parametrize("delta", DELTAS)
def test_sampled_poses_lie_in_their_cell(delta: Fraction, shifted: bool) -> None:
    pentapod = pentapod_of(delta, shifted=shifted)
    cells = cell_decomposition(pentapod.delta).cells
    for index, cell in enumerate(cells):
        p, i = poses_in_cell(pentapod, index, 200, seed=index)
        np.testing.assert_allclose(np.linalg.norm(i, axis=1), 1.0, rtol=1e-14)
        np.testing.assert_array_equal(cell_of(pentapod, p, i), index)
        if cell.dimension == 5:
            assert (pentapod.branch(p, i) == COMPONENTS[index]).all()


@pytest.mark.parametrize("delta", [DELTAS[0], *(pytest.param(d, marks=pytest.mark.slow) for d in DELTAS[1:3])])
def test_boundaries_can_be_approached_and_no_others(delta: Fraction, random_poses) -> None:
    """Draw poses close to a pose of one cell, at many scales; the cells they fall in are those it bounds."""
    pentapod = pentapod_of(delta)
    decomposition = cell_decomposition(pentapod.delta)
    rng = np.random.default_rng(42)
    slope, count, near = pentapod.delta, 60_000, 1e-3
    for a in range(4, len(decomposition.cells)):  # a component is open, and bounds nothing
        p0, i0 = (array[0] for array in poses_in_cell(pentapod, a, 1, seed=43))
        # Each coordinate is left alone or changed by anything between 1e-9 and 1e-4 ...
        change = rng.choice((-1.0, 0.0, 1.0), size=(count, 4)) * 10.0 ** rng.uniform(-9, -4, size=(count, 4))
        w = i0[2] + change[:, 0]
        x, z = (p0[[0, 2]] + change[:, 2:]).T
        # ... or such that the pose lies on S = 0, whichever of u, px and pz has to give.
        kind = rng.integers(4, size=count)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            u = np.where(kind == 3, 1.0 / slope + w * x / z, i0[0] + change[:, 1])
            u = np.clip(np.where(np.isfinite(u), u, 2.0), -np.sqrt(1.0 - w * w), np.sqrt(1.0 - w * w))
            tilt = 1.0 - slope * u
            on_x, on_z = -tilt * z / (slope * w), -slope * w * x / tilt
        x = np.where((kind % 2 == 1) & (np.abs(on_x - p0[0]) < near), on_x, x)
        z = np.where((kind == 2) & (np.abs(on_z - p0[2]) < near), on_z, z)
        i = np.stack([u, np.copysign(np.sqrt(np.maximum(1.0 - u * u - w * w, 0.0)), i0[1]), w], axis=1)
        p = np.stack([x, np.full(count, p0[1]), z], axis=1)
        close = (np.abs(i - i0).max(axis=1) < 0.05) & (np.abs(p - p0).max(axis=1) < near)
        found = set(np.unique(cell_of(pentapod, p[close], i[close], tolerance=1e-15)).tolist()) - {a}
        expected = set(np.flatnonzero(decomposition.incidence[a]).tolist())
        assert found == expected, str(decomposition.cells[a])


def test_bad_questions() -> None:
    with pytest.raises(ArrayError, match="every pose is singular"):
        cell_decomposition(0.0)
    pentapod = pentapod_of(Fraction(1, 2))
    with pytest.raises(ArrayError, match="no such cell"):
        poses_in_cell(pentapod, 15, 1)
    assert cell_of(pentapod, [np.nan, 0.0, 1.0], [0.0, 0.0, 1.0]) == -1
    assert cell_of(pentapod, np.ones((2, 1, 3)), [0.36, 0.48, 0.8]).shape == (2, 1)
    assert str(cell_decomposition(0.5).cells[4]) == "w = 0, pz > 0, δu < 1"
