"""Bounds over boxes of poses: no pose of a box is worse, and small boxes have bounds close to their poses."""

from dataclasses import replace

import numpy as np
import pytest

from designs import geometry_of
from pentapod.design.bounds import Boxes
from pentapod.design.figures import in_poses
from pentapod.design.proof import FORCES, SHAPE, ProofOptions, bounds_of_forces, bounds_of_shape, prove

SIZES = {"wide": 1.0, "middle": 0.3, "narrow": 0.05}
HALF = np.array([0.01, 0.2, 0.01, 0.05, 0.2])
CLOSE = {
    "shortest_leg": 3e-4, "longest_leg": 3e-4, "base_cone": 1e-3, "platform_least": 3e-3, "platform_most": 3e-3,
    "leg_clearance": 3e-3, "shaft_clearance": 3e-4, "singular_distance": 2e-3, "amplification": 0.1, "sensitivity": 0.1,
}  # fmt: skip


def boxes_of(name: str, scale: float, count: int = 60) -> tuple[Boxes, np.random.Generator]:
    design, rng = geometry_of(name), np.random.default_rng(7)
    high = np.array([0.5 * design.diameter, 2.0 * np.pi, 0.5 * design.height, design.tilt, 2.0 * np.pi])
    low = np.array([0.0, 0.0, -high[2], 0.0, 0.0])
    half = np.minimum(scale * HALF, 0.5 * (high - low)) * rng.uniform(0.3, 1.0, (count, len(high)))
    centre = rng.uniform(low + half, high - half)
    return Boxes(design, design.base_axes(), centre, half), rng


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", ["desk", "steep", "bench-general"])
def test_no_pose_of_a_box_is_beyond_its_bounds(name, size):
    boxes, rng = boxes_of(name, SIZES[size])
    names = [key for key in SHAPE if key != "singular_distance" or boxes.design.delta is not None]
    bounds = dict(zip(names, bounds_of_shape(boxes).T, strict=True)) | dict(
        zip(FORCES, bounds_of_forces(boxes).T, strict=True)
    )
    worst = {key: np.full(len(boxes.centre), -np.inf) for key in bounds}
    for share in [*rng.choice([-1.0, 1.0], (60, 1, 5)), *rng.uniform(-1.0, 1.0, (60, len(boxes.centre), 5))]:
        inner = replace(boxes, centre=boxes.centre + share * boxes.half)
        for key, values in in_poses(boxes.design, boxes.axes, inner.tips, inner.directions).items():
            if key in bounds:
                worst[key] = np.maximum(worst[key], SHAPE.get(key, (1.0, ""))[0] * values)
    for key, bound in bounds.items():
        assert (worst[key] <= bound + 1e-9).all(), key
        if size == "narrow":
            assert np.median(bound - worst[key]) < CLOSE[key], key


def test_proof_of_a_small_volume_is_close_to_its_worst_pose():
    """20 mm across with a cone of 8 degrees: bounds a step from what is known, and no random pose is beyond."""
    design = replace(geometry_of("desk"), diameter=0.02, height=0.01, tilt=np.radians(8.0))
    axes, options = design.base_axes(), ProofOptions()
    proof = prove(design, axes, options)
    assert proof.settled
    rng = np.random.default_rng(3)
    unit = rng.uniform((0.0, 0.0, -1.0, 0.0, 0.0), (1.0, 2 * np.pi, 1.0, 1.0, 2 * np.pi), (20_000, 5))
    tried = in_poses(design, axes, *design.poses(unit))
    for key, (sense, kind) in (SHAPE | dict.fromkeys(FORCES, (1.0, "force"))).items():
        beyond = sense * (proof.proven[key] - proof.found[key])
        step = getattr(options, kind) * (proof.found[key] if key in FORCES else 1.0)
        assert 0.0 <= beyond <= step * 1.001, key
        assert (sense * tried[key]).max() <= sense * proof.proven[key], key


def test_too_few_boxes_leave_a_bound_that_is_wide_but_holds():
    design = geometry_of("desk")
    proof = prove(design, design.base_axes(), ProofOptions(most=500, block=64))
    assert not proof.settled
    assert proof.proven["longest_leg"] >= proof.found["longest_leg"] > 0.9
    assert proof.proven["amplification"] > proof.found["amplification"]


def test_a_volume_with_a_singularity_has_no_bound_of_forces():
    """`desk` with its work so near that S = 0 runs through it."""
    design = geometry_of("desk")
    near = replace(design, centre=design.centre - np.array([0.0, 0.0, 0.26]))
    proof = prove(near, near.base_axes(), ProofOptions(around=8, azimuths=8, most=2000, block=512))
    assert proof.proven["amplification"] > 100.0
    assert proof.proven["singular_distance"] < 0.0
