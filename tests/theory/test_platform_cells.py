"""Cells of the 6-SPU platform: eight components for eight modes, and lines through a_6 only where they are said."""

import numpy as np
import pytest

from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics import GeneralPentapod, LinearPentapod, SixLegPlatform
from pentapod.theory import (
    cell_decomposition,
    cell_of,
    platform_cell_decomposition,
    platform_cell_of,
    poses_in_cell,
)

BASE = np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
SIXTH = np.array([1.4, 0.3, 0.0])


def platform_of(delta: float) -> SixLegPlatform:
    return SixLegPlatform(LinearPentapod.quadratic(BASE, delta), SIXTH, np.array([0.3, 0.1, 0.2]))


def frame(i: np.ndarray, turn: float) -> np.ndarray:
    """A rotation whose third column is i, turned about it."""
    first = np.cross(i, [0.3, -0.5, 0.7])
    first /= np.linalg.norm(first)
    second = np.cross(i, first)
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([c * first + s * second, -s * first + c * second, i], axis=1)


@pytest.mark.parametrize("delta", [0.5, 1.0, 5.0 / 3.0, -0.5])
def test_there_are_eight_components_one_for_each_assembly_mode(delta: float) -> None:
    platform, cells = platform_of(delta), platform_cell_decomposition(delta, SIXTH[0])
    assert len(cells.components) == cells.counts()[0] == 8
    rng, seen = np.random.default_rng(1), 0
    for _ in range(30):
        i = rng.normal(size=3)
        p, r = rng.normal(size=3), frame(i / np.linalg.norm(i), rng.uniform(0.0, 6.0))
        positions, rotations = platform.assembly_modes(platform.leg_lengths(p, r))
        known = np.flatnonzero(np.isfinite(positions).all(axis=1))
        where = {platform_cell_of(platform, positions[k], rotations[k]) for k in known}
        assert len(where) == len(known)  # no two modes in one component
        assert all(cells.cells[k].regular for k in where)
        seen = max(seen, len(known))
    assert seen == 8


def test_the_counts_for_a_small_delta() -> None:
    """Twice the line's cells one dimension up, twice in their own, and those of lines through a_6."""
    line, whole = (4, 6, 4, 1, 0), platform_cell_decomposition(0.5, 1.4).counts()
    through = (0, 0, 4, 2 + 2, 1, 0)  # of dimension 6 ... 1
    doubled = tuple(2 * a + 2 * b + c for a, b, c in zip((*line, 0), (0, *line), through, strict=True))
    assert whole == doubled


@pytest.mark.parametrize("delta", [0.5, 1.0, 5.0 / 3.0, -5.0 / 3.0])
@pytest.mark.parametrize("x6", [1.4, pytest.param(-0.8, marks=pytest.mark.slow)])
def test_lines_through_a6_are_in_the_cells_that_say_so_and_in_no_others(delta: float, x6: float) -> None:
    """Drawn by their definition, with each special value of (s, i) in turn; the cell is found by the pose alone."""
    pentapod, rng = LinearPentapod.quadratic(BASE, delta), np.random.default_rng(3)
    cells, found = cell_decomposition(delta).cells, set()
    a6 = np.array([x6, 0.3, 0.0])
    for _ in range(150):
        for flat in (False, True):
            i = rng.normal(size=3)
            i[2] *= not flat
            i /= np.linalg.norm(i)
            if flat and abs(delta) >= 1.0 and rng.random() < 0.5:
                u = 1.0 / delta
                i = np.array([u, rng.choice([-1.0, 1.0]) * np.sqrt(max(1.0 - u * u, 0.0)), 0.0])
            for s in (float(rng.normal(scale=2.0)), delta * x6, x6 / i[0]):
                found.add(int(cell_of(pentapod, a6 - s * i, i, tolerance=1e-9)))
    said = {
        cells.index(cell.line) for cell in platform_cell_decomposition(delta, x6).cells if cell.turn == "line through"
    }
    assert found == said


def test_a_pose_of_each_kind_is_found_in_its_cell() -> None:
    platform = platform_of(0.5)
    cells = platform_cell_decomposition(0.5, SIXTH[0]).cells
    pentapod = platform.pentapod
    assert isinstance(pentapod, LinearPentapod)
    for k, line in enumerate(cell_decomposition(0.5).cells):
        p, i = (x[0] for x in poses_in_cell(pentapod, k, 1, seed=2))
        turns = set()
        for turn in np.linspace(0.0, 2.0 * np.pi, 9):
            cell = cells[platform_cell_of(platform, p, frame(i, float(turn)))]
            assert cell.line == line
            turns.add(cell.turn)
        assert {"twist > 0", "twist < 0"} <= turns
        seen = SIXTH - p
        towards = seen - (seen @ i) * i
        towards /= np.linalg.norm(towards)
        azimuth = np.arctan2(0.1, 0.3)
        for sign, name in ((1.0, "arm towards"), (-1.0, "arm away")):
            radial, across = sign * towards, np.cross(i, sign * towards)
            c, s = np.cos(azimuth), np.sin(azimuth)
            r = np.stack([c * radial - s * across, s * radial + c * across, i], axis=1)
            assert cells[platform_cell_of(platform, p, r, tolerance=1e-9)].turn == name


def test_special_positions_of_the_sixth_leg_are_refused() -> None:
    with pytest.raises(ArrayError, match="level with leg 3"):
        platform_cell_decomposition(0.5, 0.0)
    with pytest.raises(ArrayError, match="delta is 0"):
        platform_cell_decomposition(0.0, 1.0)
    general = SixLegPlatform(GeneralPentapod(BASE, [0.1, -0.4, 0.0, 0.7, 0.9]), SIXTH, np.array([0.3, 0.1, 0.2]))
    with pytest.raises(MachineError, match="no cells are known"):
        platform_cell_of(general, [0.0, 0.0, 1.0], np.eye(3))
