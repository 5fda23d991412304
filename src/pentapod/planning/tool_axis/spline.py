"""AxisSpline: the lean of the tool along a path as a cubic B-spline, and its quadratic smoothness cost.

The lean is a vector across the nominal axis, in a frame that is transported in parallel along the path; its two
components are a cubic spline over the path length of the tilt centre, with knots at waypoints. The spline stays within
the convex hull of its coefficients: it keeps the cone everywhere if they do.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.directions import rotation_minimising_frames
from pentapod.numerics.convex.banded_qp import banded, banded_product
from pentapod.numerics.divided_differences import as_matrix, divided_differences
from pentapod.planning.problem.samples import ToolpathSamples


@dataclass(frozen=True)
class SplineOptions:
    """Knots and cost of the spline.

    knot_spacing: least distance between knots, metres; less on small parts, which have intervals_per_extent knot
    intervals. Where waypoints are farther apart there is a knot at each. nodes: nodes of the cost in a knot interval,
    at most. lever: path length of one radian of the nominal axis, metres, so that a turn on the spot has knots too.
    foresight: metres along the path over which the axis turns ahead of a corner: weight of rates, and with its square
    of second derivatives. upright_weight: of the lean itself. least_curvature: of coefficients on which the cost does
    not depend.
    """

    knot_spacing: float = 2e-3
    intervals_per_extent: int = 50
    nodes: int = 2
    lever: float = 10e-3
    foresight: float = 20e-3
    upright_weight: float = 1e-2
    least_curvature: float = 1e-10


OPTIONS = SplineOptions()

_DEGREE = 3
BANDS = 10
"""Diagonals of the cost, main one and below: a second difference reaches over five coefficients of two numbers."""


@dataclass(frozen=True, eq=False)
class AxisSpline:
    """Leans along a path: those at its waypoints are cone · basis @ c, for coefficients c (K, 2) in the unit disc.

    basis (N, K) sparse, four neighbours a row, times the share of the cone that may be used there; frames (N, 2, 3):
    the frame at each waypoint, workpiece frame. nodes (n,): waypoints at which the cost takes derivatives; stations
    (n,): their path lengths, metres. The cost of c is cᵀHc/2 + gᵀc + constant, hessian (BANDS, 2K) in SciPy's lower
    banded form, in the order of c.ravel().
    """

    cone: float
    basis: Any
    frames: Floats
    nodes: Ints
    stations: Floats
    hessian: Floats
    gradient: Floats
    constant: float

    @classmethod
    def of(cls, samples: ToolpathSamples, cone: float) -> AxisSpline:
        """Return the spline along the waypoints of `samples`. cone: the longest lean (tangent of the angle)."""
        places = stations_of(samples)
        extent = float(np.linalg.norm(np.ptp(samples.tilt_centres, axis=0)))
        spacing = min(OPTIONS.knot_spacing, max(extent, OPTIONS.lever) / OPTIONS.intervals_per_extent)
        # Between waypoints the tool moves on straight lines, so derivatives are differences of waypoints. Two nodes for
        # each knot where there are as many: at the knots alone the cost hardly depends on alternating coefficients.
        nodes = _spaced(places, spacing / OPTIONS.nodes)
        basis = sparse.csr_matrix(BSpline.design_matrix(places, _knots(places[nodes], spacing), _DEGREE))
        if samples.shares is not None:
            basis.data *= np.repeat(samples.shares, np.diff(basis.indptr))
        frames = rotation_minimising_frames(samples.nominal)
        cost = _cost(samples.nominal[nodes], cone * frames[nodes], basis[nodes], places[nodes])
        return cls(cone, basis, frames, nodes, places[nodes], *cost)

    def leans(self, c: Floats, rows: Ints | slice = slice(None)) -> Floats:
        """Return the leans (n, 3) at waypoints `rows`, across the nominal axes, workpiece frame."""
        along: Floats = self.cone * (self.basis[rows] @ c)
        return np.einsum("na,nak->nk", along, self.frames[rows])

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
        """Return the coefficients (K, 2) within the cone of a smoothing fit to leans (N, 3)."""
        wanted = np.einsum("nk,nak->na", leans, self.frames) / self.cone
        size = self.hessian.shape[1] // 2
        rate, bend = _differences(size, 1), _differences(size, 2)
        normal = self.basis.T @ self.basis + 1e-6 * (bend.T @ bend) + 1e-9 * (rate.T @ rate) + 1e-12 * sparse.eye(size)
        c = solveh_banded(banded(normal, _DEGREE + 1), self.basis.T @ wanted, lower=True)
        return within_discs(np.asarray(c, dtype=np.float64))


def within_discs(c: Floats) -> Floats:
    """Return coefficients (K, 2) with those outside the unit disc projected onto its edge."""
    return c / np.maximum(1.0, np.linalg.norm(c, axis=1, keepdims=True))


def stations_of(samples: ToolpathSamples) -> Floats:
    """Return the path length (N,) in metres at each waypoint: of the tilt centre, and of the axis by its lever."""
    moved = np.linalg.norm(np.diff(samples.tilt_centres, axis=0), axis=1)
    turned = np.linalg.norm(np.diff(samples.nominal, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(moved + OPTIONS.lever * turned)])


def _spaced(stations: Floats, spacing: float) -> Ints:
    """Return indices of ascending stations (N,) at least about `spacing` apart, first and last included.

    Only the first where the path has no length.
    """
    places, found = stations.tolist(), [0]
    while (index := bisect_left(places, places[found[-1]] + spacing, found[-1] + 1)) < len(places):
        found.append(index)
    if places[-1] - places[found[-1]] > 1e-9:  # metres: shorter paths have no length
        if len(found) > 1 and places[-1] - places[found[-1]] < 0.5 * spacing:
            found.pop()
        found.append(len(places) - 1)
    return np.array(found, dtype=np.intp)


def _knots(stations: Floats, spacing: float) -> Floats:
    """Return the knots: some of the nodes' stations (n,), and three more beyond each end."""
    inner = stations[_spaced(stations, spacing)]
    if inner[-1] <= inner[0]:  # the whole path is one place
        inner = inner[0] + spacing * np.arange(2.0)
    beyond = np.arange(1.0, _DEGREE + 1.0)
    return np.concatenate([
        inner[0] - (inner[1] - inner[0]) * beyond[::-1], inner, inner[-1] + (inner[-1] - inner[-2]) * beyond
    ])  # fmt: skip


def _cost(nominal: Floats, frames: Floats, at_nodes: Any, stations: Floats) -> tuple[Floats, Floats, float]:
    """Return Hessian, gradient and constant of the mean square of the axes' derivatives and leans over the nodes.

    nominal (n, 3); frames (n, 2, 3), times the cone; at_nodes (n, K): the basis there; stations (n,).
    """
    lean, axes = _axes_by_lean(frames, at_nodes), nominal.ravel()
    size = lean.shape[1]
    hessian: Any = OPTIONS.least_curvature * sparse.identity(size, format="csr")
    gradient, constant = np.zeros(size), 0.0
    for order, weight in ((2, OPTIONS.foresight**4), (1, OPTIONS.foresight**2), (0, OPTIONS.upright_weight)):
        factors, shares = divided_differences(stations, order)
        derivative = sparse.kron(as_matrix(factors, len(stations)), sparse.identity(3), format="csr")
        weighed = sparse.diags(2.0 * weight * np.repeat(shares, 3))
        by_lean = sparse.csr_matrix(derivative @ lean)
        fixed = derivative @ axes if order > 0 else np.zeros(len(axes))
        hessian = hessian + by_lean.T @ weighed @ by_lean
        gradient = gradient + by_lean.T @ (weighed @ fixed)
        constant += 0.5 * float(fixed @ (weighed @ fixed))
    return banded(hessian, BANDS), gradient, constant


def _axes_by_lean(frames: Floats, at_nodes: Any) -> Any:
    """Return the sparse matrix (3n, 2K) from coefficients to axes at the nodes: nominal plus lean, not normalised.

    frames (n, 2, 3), times the cone; at_nodes (n, K): the basis. Being linear, it makes the cost a quadratic.
    """
    count = len(frames)
    pair = sparse.kron(at_nodes, sparse.identity(2), format="csr")  # (2n, 2K): the lean's two components at each node
    node = np.arange(count)
    rows = np.broadcast_to((3 * node[:, None] + np.arange(3))[:, None, :], frames.shape)
    columns = np.broadcast_to((2 * node[:, None] + np.arange(2))[:, :, None], frames.shape)
    spread = sparse.csr_matrix((frames.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * count, 2 * count))
    return sparse.csr_matrix(spread @ pair)


def _differences(count: int, order: int) -> Any:
    """Return the sparse matrix (count − order, count) that takes values to their differences of this order."""
    difference: Any = sparse.identity(count, format="csr")
    for _ in range(order):
        difference = difference[1:] - difference[:-1]
    return difference
