"""choose_poses: against all subsets, against chance, and against the errors that come."""

from itertools import combinations

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.kinematics import AsBuiltPentapod
from pentapod.machine import identify, sample_work_volume
from pentapod.machine.identification.observations import PoseObservations
from pentapod.machine.identification.pose_choice import choose_poses, predicted_tip_error
from pentapod.machine.identification.sensitivity import tip_by_parameters
from true_machine import MACHINE, TOOL, measured, poses, reached, true_numbers


def candidates(n: int, seed: int = 0):
    tips, axes = poses(n, seed)
    design = AsBuiltPentapod.of(MACHINE.robot)
    p, i = tips + TOOL * axes, -axes
    seen = PoseObservations(p, i, design.leg_lengths(p, i), design, 10e-6, 20e-6)
    covariances = seen.instrument_covariances + 2e-6**2 * np.eye(5)
    columns = np.linalg.solve(np.linalg.cholesky(covariances), seen.columns(seen.start))
    where, along = sample_work_volume(MACHINE.work, rings=1, around=6, levels=2)
    return columns, tip_by_parameters(design, where + TOOL * along, -along, TOOL), (tips, axes)


def test_the_exchange_is_as_good_as_all_subsets():
    columns, moves, _ = candidates(12)
    found = choose_poses(columns, moves, 7)
    best = min(predicted_tip_error(columns[list(some)], moves) for some in combinations(range(12), 7))
    assert found.tip_sigma == pytest.approx(predicted_tip_error(columns[found.chosen], moves), rel=1e-6)
    assert found.tip_sigma <= 1.02 * best
    assert len(set(found.chosen.tolist())) == 7


def test_chosen_poses_predict_the_tip_better_than_random_ones():
    columns, moves, _ = candidates(400)
    found, rng = choose_poses(columns, moves, 20), np.random.default_rng(1)
    chance = [predicted_tip_error(columns[rng.choice(400, 20, replace=False)], moves) for _ in range(30)]
    assert found.tip_sigma < 0.65 * np.median(chance)
    assert found.tip_sigma < min(chance)


def test_a_count_that_cannot_be():
    columns, moves, _ = candidates(10)
    with pytest.raises(ArrayError, match="wrong count of poses"):
        choose_poses(columns, moves, 11)


@pytest.mark.slow
def test_calibrations_from_chosen_poses_are_as_much_better_as_predicted():
    columns, moves, (tips, axes) = candidates(400)
    chosen, rng = choose_poses(columns, moves, 20), np.random.default_rng(2)
    where, along = (array[::9] for array in sample_work_volume(MACHINE.work, rings=1, around=6, levels=2))
    errors = {"chosen": [], "chance": []}
    for seed in range(40):
        for name, some in (("chosen", chosen.chosen), ("chance", rng.choice(400, 20, replace=False))):
            seen = measured("pose", 20, seed, where=(tips[some], axes[some]))
            machine = identify(seen, MACHINE, keep_outliers=True).calibration.machine
            legs = machine.leg_lengths(where + TOOL * along, -along)
            off = reached(true_numbers(seed), legs, (where, along)) - where
            errors[name].append(np.square(off).sum(axis=1).mean())
    chosen_rms, chance_rms = (float(np.sqrt(np.mean(errors[name]))) for name in ("chosen", "chance"))
    assert chosen_rms < 0.7 * chance_rms
    assert chosen_rms == pytest.approx(chosen.tip_sigma, rel=0.25)
