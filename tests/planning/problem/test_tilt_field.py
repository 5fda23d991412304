"""The tilt field: unit axes, nothing without coefficients, smooth, the same whatever the path's sampling."""

import numpy as np

from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import FieldDomain, lean


def test_tilt_field_without_coefficients_keeps_the_nominal_axes(cap):
    domain = FieldDomain.around(cap.tilt_centres, cap.axes, 2)
    leans = domain.basis(cap.tilt_centres) @ np.zeros((domain.size, 2)) @ domain.lean_plane
    np.testing.assert_allclose(lean(cap.axes, leans), cap.axes, atol=1e-15)


def test_axes_are_unit_and_lean_by_the_part_of_b_across(cap):
    rng = np.random.default_rng(3)
    b = rng.normal(scale=0.2, size=cap.axes.shape)
    axes = lean(cap.axes, b)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-14)
    across = np.linalg.norm(np.cross(cap.axes, b), axis=1)
    angle = np.arctan2(np.linalg.norm(np.cross(cap.axes, axes), axis=1), (cap.axes * axes).sum(axis=1))
    np.testing.assert_allclose(angle, np.arctan(across), atol=1e-12)


def test_basis_is_a_partition_of_unity(cap):
    domain = FieldDomain.around(cap.tilt_centres, cap.axes, 3)
    basis = domain.basis(cap.tilt_centres)
    np.testing.assert_allclose(basis.sum(axis=1), 1.0, atol=1e-12)
    assert basis.min() >= 0.0


def test_roughness_of_a_linear_field_is_zero(cap):
    domain = FieldDomain.around(cap.tilt_centres, cap.axes, 2)
    side = domain.cells + 3
    i, j = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    assert np.abs(domain.roughness() @ (2.0 * i - 3.0 * j + 1.0).ravel()).max() < 1e-12
    assert np.abs(domain.roughness() @ (i * i).ravel()).max() > 1.0


def test_representatives_are_distinct_deterministic_and_include_extremes(cap):
    task = ToolpathSamples.of(cap, 0.1)
    rows = task.representatives(40)
    assert len(np.unique(rows)) == 40
    np.testing.assert_array_equal(rows, task.representatives(40))
    gap = np.linalg.norm(cap.tilt_centres[:, None] - cap.tilt_centres[rows][None], axis=2).min(axis=1).max()
    assert gap < 0.02  # no place of the 120 mm part is farther than that from a representative
