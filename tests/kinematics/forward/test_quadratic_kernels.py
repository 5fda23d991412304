"""Compiled kernels against NumPy: the same to the last bit, for every batch; arrays given to write to."""

import subprocess
import sys
import tracemalloc

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.kinematics import COMPONENTS, LinearPentapod
from pentapod.numerics.kernels import kernels_used


def both(action):
    """The result of an action by NumPy, and by kernels."""
    with kernels_used("never"):
        plain = action()
    with kernels_used("always"):
        return plain, action()


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two arrays hold the same numbers bit by bit; any NaN equals any other."""
    nan = np.isnan(a)
    return bool((nan == np.isnan(b)).all() and (a.view(np.int64) == b.view(np.int64))[~nan].all())


@pytest.mark.parametrize("n", [0, 1, 63, 64, 65, 20_000])
def test_kernels_equal_numpy_to_the_last_bit(pentapod: LinearPentapod, random_poses, n: int) -> None:
    p, i = random_poses(pentapod, n)
    plain, compiled = both(lambda: pentapod.leg_lengths(p, i))
    assert same(plain, compiled)
    legs = np.concatenate([plain, plain[: n // 2] * 1.4])  # many of the latter have no pose
    legs[::17, 2] *= -1.0
    signs = pentapod.branch(*np.concatenate([[p, i], [p, i]], axis=1)[:, : len(legs)])
    for component in (*COMPONENTS, signs):
        expected, found = both(lambda c=component: pentapod.pose(legs, c))
        assert same(expected[0], found[0])
        assert same(expected[1], found[1])
    if n == 20_000:
        lost = np.isnan(expected[0]).any(axis=1)
        assert 0.05 < lost.mean() < 0.45


def test_kernels_take_every_broadcast_and_layout(paper: LinearPentapod) -> None:
    p, i = np.array([[0.5, 0.25, 3.0], [0.4, 0.2, 2.5]]), np.array([0.36, 0.48, 0.8])
    plain, compiled = both(lambda: paper.leg_lengths(np.asfortranarray(p), i))
    assert same(plain, compiled)
    odd = np.asfortranarray(np.repeat(plain, 3, axis=1)[:, ::3])
    for legs, component in ((odd, (1, 1)), (odd[:, None, :], np.array(COMPONENTS)), (odd, [[1, 0], [1, np.nan]])):
        expected, found = both(lambda a=legs, c=component: paper.pose(a, c))
        assert expected[0].shape == found[0].shape
        assert same(expected[0], found[0])


@pytest.mark.parametrize("policy", ["never", "always"])
def test_results_are_written_where_asked(paper: LinearPentapod, random_poses, policy: str) -> None:
    p, i = random_poses(paper, 12)
    p, i = p.reshape(3, 4, 3), i.reshape(3, 4, 3)
    legs, position, direction = np.empty((3, 4, 5)), np.empty((3, 4, 3)), np.empty((3, 4, 3))
    with kernels_used(policy):
        assert np.shares_memory(paper.leg_lengths(p, i, out=legs), legs)
        assert same(legs, paper.leg_lengths(p, i))
        paper.pose(legs, (1, 1), out=(position, direction))
        assert same(position, paper.pose(legs, (1, 1))[0])
        assert same(direction, paper.pose(legs, (1, 1))[1])
    for bad in (np.empty((4, 3, 5)), np.empty((3, 4, 5), dtype=np.float32), np.empty((5, 4, 3)).T):
        with pytest.raises(ArrayError, match="out has shape"):
            paper.leg_lengths(p, i, out=bad)
    with pytest.raises(ArrayError, match="out has shape"):
        paper.pose(legs, (1, 1), out=(position, np.empty(3)))


@pytest.mark.parametrize("policy", ["never", "always"])
def test_temporaries_stay_below_three_times_the_input(paper: LinearPentapod, random_poses, policy: str) -> None:
    p, i = random_poses(paper, 200_000)
    legs, signs = paper.leg_lengths(p, i), paper.branch(p, i)
    position, direction = np.empty_like(p), np.empty_like(i)
    with kernels_used(policy):
        for action, size in (
            (lambda: paper.leg_lengths(p, i, out=legs), p.nbytes + i.nbytes),
            (lambda: paper.pose(legs, (1, 1), out=(position, direction)), legs.nbytes),
            (lambda: paper.pose(legs, signs, out=(position, direction)), legs.nbytes + signs.nbytes),
        ):
            action()  # whatever is cached
            tracemalloc.start()
            action()
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            assert peak < 3 * size


def test_small_work_does_not_load_numba_and_much_work_does() -> None:
    code = (
        "import sys, numpy as np\n"
        "from pentapod.numerics.kernels import kernels_pay\n"
        "from pentapod.kinematics import LinearPentapod\n"
        "robot = LinearPentapod.quadratic([(-2, 1), (-1, -2), (0, 0), (1, -2), (2, 2)], 0.5)\n"
        "p, i = np.tile([0.5, 0.25, 3.0], (100_000, 1)), np.array([0.36, 0.48, 0.8])\n"
        "legs = robot.leg_lengths(p, i)\n"
        "print('numba' in sys.modules)\n"
        "kernels_pay(0.499)\n"  # as much as sixteen million poses before
        "legs = robot.leg_lengths(p, i, out=legs)\n"
        "print('numba' in sys.modules)\n"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.split() == ["False", "True"]
