"""AxisCourse: the lean of the tool along a path as one spline, and the cost that a calm course makes small.

The lean is a vector across the nominal axis, told in a pair of directions that is carried along the path; its two
numbers are a cubic spline over the way of the pivot, a few knots for each centimetre. The spline stays within the
convex hull of its coefficients, so a course whose coefficients keep the cone keeps it everywhere, and turns nowhere
faster than they do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded

from pentapod.arrays import Floats, Ints
from pentapod.geometry.transport import carried_frames
from pentapod.planning.task import Task

KNOT_SPACING_M = 2e-3
"""Longest way between knots; shorter on small parts."""
LEVER_M = 10e-3
"""How much way one radian of the nominal axis counts for, so that a turn on the spot has knots too."""
FORESIGHT_M = 20e-3
"""Over what way the axis turns ahead of a corner: rates count with this length, second derivatives with its square."""
UPRIGHT_WEIGHT = 1e-2
"""Of the lean itself beside its rates: a lean that serves nothing fades."""

_DEGREE = 3
_MARKS = 4  # a knot interval
_INTERVALS_PER_EXTENT = 50
BANDS = 10
"""Diagonals of the cost, main one and below: a second difference reaches over five coefficients of two numbers."""


@dataclass(frozen=True, eq=False)
class AxisCourse:
    """Leans along a task's path: those at its waypoints are cone · basis @ c, for coefficients c in the unit disc.

    c (K, 2); basis (N, K) sparse; frames (N, 2, 3): the pair at each waypoint, workpiece frame.
    marks: waypoints that stand for all, as many as the spline can tell apart.
    The cost of c is cᵀHc/2 + gᵀc + constant, hessian (BANDS, 2K) in SciPy's lower banded form, in the order of
    c.ravel().
    """

    cone: float
    basis: Any
    frames: Floats
    marks: Ints
    hessian: Floats
    gradient: Floats
    constant: float

    @classmethod
    def of(cls, task: Task, cone: float) -> AxisCourse:
        """Return the course of a task. cone: the longest lean (tangent of the angle)."""
        way = _way(task)
        extent = float(np.linalg.norm(np.ptp(task.pivots, axis=0)))
        spacing = min(KNOT_SPACING_M, max(extent, LEVER_M) / _INTERVALS_PER_EXTENT)
        count = int(np.clip(np.ceil(way[-1] / spacing), 4, 2 * len(way) + 8))
        step = max(float(way[-1]), 1e-9) / count
        knots = step * np.arange(-_DEGREE, count + _DEGREE + 1.0)
        # Two nodes an interval: at the knots alone the cost would not see coefficients that alternate.
        nodes = 0.5 * step * np.arange(2.0 * count + 1.0)
        # Waypoints and nodes in one sequence, so that both are told in the same carried pairs.
        order = np.argsort(np.concatenate([way, nodes]), kind="stable")
        places = np.empty_like(order)
        places[order] = np.arange(len(order))
        nominal = np.concatenate([task.nominal, _between(way, task.nominal, nodes)])
        frames = carried_frames(nominal[order])[places]
        basis = BSpline.design_matrix(np.clip(way, 0.0, nodes[-1]), knots, _DEGREE)
        at_nodes = BSpline.design_matrix(nodes, knots, _DEGREE)
        cost = _cost(nominal[len(way) :], cone * frames[len(way) :], at_nodes, 0.5 * step)
        marks = np.unique(np.floor(_MARKS * way / step), return_index=True)[1]
        return cls(cone, sparse.csr_matrix(basis), frames[: len(way)], marks, *cost)

    def leans(self, c: Floats) -> Floats:
        """Return the leans (N, 3) at the waypoints, across the nominal axes, workpiece frame."""
        along: Floats = self.cone * (self.basis @ c)
        return np.einsum("na,nak->nk", along, self.frames)

    def cost_of(self, c: Floats) -> float:
        """Return the cost of coefficients c (K, 2): mean squares of second derivative, rate and lean, in rad²."""
        x = c.ravel()
        return float(0.5 * x @ banded_product(self.hessian, x) + self.gradient @ x + self.constant)

    def whole_hessian(self) -> Any:
        """Return the Hessian as a sparse matrix (2K, 2K)."""
        size = self.hessian.shape[1]
        lower = sparse.spdiags(self.hessian, -np.arange(BANDS), size, size)
        return sparse.csc_matrix(lower + sparse.tril(lower, -1).T)

    def fitted(self, leans: Floats) -> Floats:
        """Return the coefficients (K, 2) within the cone that come near leans (N, 3), smooth between the waypoints."""
        wanted = np.einsum("nk,nak->na", leans, self.frames) / self.cone
        size = self.hessian.shape[1] // 2
        rate, bend = _differences(size, 1), _differences(size, 2)
        normal = self.basis.T @ self.basis + 1e-6 * (bend.T @ bend) + 1e-9 * (rate.T @ rate) + 1e-12 * sparse.eye(size)
        c = solveh_banded(_banded(normal, _DEGREE + 1), self.basis.T @ wanted, lower=True)
        return within_discs(np.asarray(c, dtype=np.float64))


def within_discs(c: Floats) -> Floats:
    """Return coefficients (K, 2) with those outside the unit disc brought to its edge."""
    return c / np.maximum(1.0, np.linalg.norm(c, axis=1, keepdims=True))


def banded_product(lower: Floats, x: Floats) -> Floats:
    """Return H x of a symmetric matrix in SciPy's lower banded form (B, n)."""
    y = lower[0] * x
    for k in range(1, len(lower)):
        y[k:] += lower[k, :-k] * x[:-k]
        y[:-k] += lower[k, :-k] * x[k:]
    return y


def _way(task: Task) -> Floats:
    """Return the way (N,) in metres to each waypoint: of the pivot, and of the axis by its lever."""
    moved = np.linalg.norm(np.diff(task.pivots, axis=0), axis=1)
    turned = np.linalg.norm(np.diff(task.nominal, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(moved + LEVER_M * turned)])


def _between(way: Floats, nominal: Floats, nodes: Floats) -> Floats:
    """Return unit axes at the nodes, linear between the waypoints'."""
    axes = np.stack([np.interp(nodes, way, column) for column in nominal.T], axis=1)
    length = np.linalg.norm(axes, axis=1, keepdims=True)
    return np.where(length > 1e-6, axes / np.maximum(length, 1e-6), [0.0, 0.0, 1.0])


def _cost(nominal: Floats, frames: Floats, at_nodes: Any, step: float) -> tuple[Floats, Floats, float]:
    """Return Hessian, gradient and constant of the mean square of the axes' derivatives and leans over the nodes.

    nominal (n, 3); frames (n, 2, 3), the pairs times the cone; at_nodes (n, K): the basis there. The axes are taken
    as nominal plus lean, not normalised, which makes the cost a quadratic.
    """
    count, size = at_nodes.shape
    pair = sparse.kron(at_nodes, sparse.eye(2), format="csr")  # (2n, 2K): the lean's two numbers at each node
    node = np.arange(count)
    rows = np.broadcast_to((3 * node[:, None] + np.arange(3))[:, None, :], frames.shape)
    columns = np.broadcast_to((2 * node[:, None] + np.arange(2))[:, :, None], frames.shape)
    spread = sparse.csr_matrix((frames.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * count, 2 * count))
    lean = sparse.csr_matrix(spread @ pair)
    hessian: Any = sparse.csr_matrix((2 * size, 2 * size))
    gradient, constant = np.zeros(2 * size), 0.0
    axes = nominal.ravel()
    terms = ((2, (FORESIGHT_M / step) ** 4), (1, (FORESIGHT_M / step) ** 2), (0, UPRIGHT_WEIGHT))
    for order, weight in terms:
        difference: Any = sparse.kron(_differences(count, order), sparse.eye(3), format="csr")
        by_lean = difference @ lean
        fixed = difference @ axes if order > 0 else np.zeros(3 * count)
        hessian = hessian + (2.0 * weight / count) * (by_lean.T @ by_lean)
        gradient = gradient + (2.0 * weight / count) * (by_lean.T @ fixed)
        constant += weight / count * float(fixed @ fixed)
    return _banded(hessian + 1e-12 * sparse.eye(2 * size), BANDS), gradient, constant


def _differences(count: int, order: int) -> Any:
    """Return the sparse matrix (count − order, count) that takes values to their differences of this order."""
    difference: Any = sparse.eye(count, format="csr")
    for _ in range(order):
        difference = difference[1:] - difference[:-1]
    return difference


def _banded(matrix: Any, bands: int) -> Floats:
    """Return a symmetric sparse matrix in SciPy's lower banded form (bands, n)."""
    lower = np.zeros((bands, matrix.shape[0]))
    for k in range(bands):
        diagonal = matrix.diagonal(-k)
        lower[k, : len(diagonal)] = diagonal
    return lower
