"""PlacementProblem: the max-min problem of all placement solvers; Candidate: a point of its search space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.robot import Branch
from pentapod.machine.clearance.collision_world import NOTHING, CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.limits.margins import Margins
from pentapod.planning.problem.constraints import FREE, PlacementConstraints
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import FieldDomain, lean
from pentapod.planning.problem.weights import EVEN, NEEDED_MARGIN, Weights, weighed

CONE_SHARE = 0.98
"""Share of the tilt cone used by the optimisers; the rest absorbs what happens between waypoints."""

FIELD_CELLS = 2
"""Spline cells of the tilt field in either direction."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A placement in the branch of its margins, with a tilt field's coefficients, and its smallest margin, weighed."""

    margins: Margins
    transform: RigidTransform
    coefficients: Floats
    smallest: float


@dataclass(frozen=True, eq=False)
class PlacementProblem:
    """Maximise the smallest weighted margin over the placement of a part and the tilt field of the tool.

    margins: one for each branch to choose from. basis (N, size): the tilt field's spline basis at the waypoints, times
    the share of the cone that may be used there; without a tilt cone it has size 0. spare (N,): margin to obstacles
    that waypoints need besides; None where none does.
    """

    samples: ToolpathSamples
    machine: Machine
    margins: tuple[Margins, ...]
    domain: FieldDomain
    basis: Floats
    constraints: PlacementConstraints
    weights: Weights
    spare: Floats | None = None

    @classmethod
    def of(
        cls,
        samples: ToolpathSamples,
        machine: Machine,
        constraints: PlacementConstraints = FREE,
        weights: Weights = EVEN,
        *,
        component: Branch | None = None,
        collision_world: CollisionWorld = NOTHING,
        limits: Sequence[LimitKind] = (),
    ) -> PlacementProblem:
        """Return the problem of samples on a machine, with the allowed placements and the weights of the margins.

        component: the branch to work in, any by default. limits: further ones, see `Margins.of`.
        """
        branches = machine.robot.branches if component is None else (component,)
        margins = tuple(Margins.of(machine, branch, collision_world, limits) for branch in branches)
        return cls(samples, machine, margins, *_field(samples), constraints, weights)

    def along(self, samples: ToolpathSamples) -> PlacementProblem:
        """Return the same problem for another path or tilt cone."""
        domain, basis = _field(samples)
        return replace(self, samples=samples, domain=domain, basis=basis)

    def at(self, rows: Ints) -> PlacementProblem:
        """Return the problem of the waypoints `rows` alone, with the same tilt field."""
        spare = None if self.spare is None else self.spare[rows]
        return replace(self, samples=self.samples.at(rows), basis=self.basis[rows], spare=spare)

    def at_all(self, samples: ToolpathSamples) -> PlacementProblem:
        """Return the problem of all waypoints of the path, which has the samples `samples` along its own axes."""
        if self.samples.common_axis is not None:
            samples = samples.towards(self.samples.common_axis)
        return replace(self, samples=samples, basis=_basis(self.domain, samples))

    def on(self, machine: Machine) -> PlacementProblem:
        """Return the same problem on another machine."""
        return replace(self, machine=machine, margins=tuple(margins.on(machine) for margins in self.margins))

    def in_world(self, collision_world: CollisionWorld) -> PlacementProblem:
        """Return the same problem in another collision world."""
        return replace(self, margins=tuple(margins.in_world(collision_world) for margins in self.margins))

    def without_collision_world(self) -> PlacementProblem:
        """Return the same problem in an empty collision world."""
        return self.in_world(NOTHING)

    @property
    def cone(self) -> float:
        """The longest lean (tangent of the angle) for the optimisers."""
        return float(np.tan(self.samples.tilt) * CONE_SHARE)

    @property
    def upright(self) -> Floats:
        """The coefficients (size, 2) of the nominal axes."""
        return np.zeros((self.basis.shape[1], 2))

    def leans(self, coefficients: Floats, rows: Ints | slice = slice(None)) -> Floats:
        """Return the leans (n, 3) across the nominal axes, workpiece frame, at waypoints `rows`."""
        b = self.basis[rows] @ coefficients @ self.domain.lean_plane
        nominal = self.samples.nominal[rows]
        return np.asarray(b - (b * nominal).sum(axis=1, keepdims=True) * nominal, dtype=np.float64)

    def axes(self, coefficients: Floats, rows: Ints | slice = slice(None)) -> Floats:
        """Return the tool axes (n, 3), workpiece frame, at waypoints `rows`."""
        return lean(self.samples.nominal[rows], self.leans(coefficients, rows))

    def values(
        self, margins: Margins, transform: RigidTransform, coefficients: Floats, rows: Ints | slice = slice(None)
    ) -> Floats:
        """Return the margins (n, M), weighed, of the tilt field with these coefficients at waypoints `rows`."""
        return self.values_of(margins, transform, self.leans(coefficients, rows), rows)

    def values_of(
        self, margins: Margins, transform: RigidTransform, leans: Floats, rows: Ints | slice = slice(None),
        enough: float = np.inf,
    ) -> Floats:  # fmt: skip
        """Return the margins (n, M), weighed, for leans (n, 3), workpiece frame, at waypoints `rows`.

        enough: larger margins to obstacles need not be exact, only at least this; that takes less time.
        """
        axes = lean(self.samples.nominal[rows], leans)
        poses = self.samples.machine_poses(transform, axes, rows)
        spare = None if self.spare is None else self.spare[rows, None]
        enough = self.weights.plain(enough) + (0.0 if spare is None else float(spare.max(initial=0.0)))
        plain = margins(*poses, transform, enough=enough)
        if spare is not None:
            plain[..., len(margins.own_limits) :] -= spare
        return plain if self.weights.are_even else weighed(plain, self.weights.of(margins.limits))

    def contacts(self, margins: Margins, transform: RigidTransform, leans: Floats, rows: Ints) -> Floats:
        """Return the contacts (n, margins.contact_numbers) at waypoints `rows`.

        leans (n, 3): workpiece frame; only their components across the nominal axes are used.
        """
        nominal = self.samples.nominal[rows]
        across = leans - (leans * nominal).sum(axis=1, keepdims=True) * nominal
        return margins.contacts(*self.samples.machine_poses(transform, lean(nominal, across), rows), transform)

    def steepness(self, coefficients: Floats, rows: Ints | slice = slice(None)) -> Floats:
        """Return the share of its longest lean (n,) that each lean uses: 1 on the edge of the cone."""
        return np.linalg.norm(self.leans(coefficients, rows), axis=1) / self.longest(rows)

    def longest(self, rows: Ints | slice = slice(None)) -> Floats:
        """Return the longest lean (n,) (tangent of the angle) at waypoints `rows`, above 0."""
        return max(self.cone, 1e-12) * self.samples.room(rows)

    def within_cone(self, coefficients: Floats) -> Floats:
        """Return coefficients scaled down until every waypoint keeps the cone; a lean is linear in them."""
        return coefficients / max(1.0, float(self.steepness(coefficients).max(initial=0.0)))

    def rank(self, at: Candidate) -> tuple[float, float]:
        """Return what candidates are compared by: whether the machine by itself keeps its limits, then the margin.

        Of two that do not fit, one at which only bodies touch is nearer to a plan than one in a wrong branch, though
        the tool may be deeper in the part there than that one's legs are too short.
        """
        if at.smallest >= NEEDED_MARGIN:
            return NEEDED_MARGIN, at.smallest
        poses = self.samples.machine_poses(at.transform, self.axes(at.coefficients))
        return min(float(at.margins.least_own(*poses).min()), NEEDED_MARGIN), at.smallest

    def candidate(self, margins: Margins, transform: RigidTransform, coefficients: Floats) -> Candidate:
        """Return the candidate with its smallest margin over all waypoints."""
        smallest = float(self.values(margins, transform, coefficients).min())
        return Candidate(margins, transform, coefficients, smallest)


def _field(samples: ToolpathSamples) -> tuple[FieldDomain, Floats]:
    """Return the domain of the tilt field of a path, and its basis (N, size) at the waypoints."""
    domain = FieldDomain.around(samples.tilt_centres, samples.nominal, FIELD_CELLS)
    return domain, _basis(domain, samples)


def _basis(domain: FieldDomain, samples: ToolpathSamples) -> Floats:
    if samples.tilt == 0.0:
        return np.zeros((len(samples.tilt_centres), 0))
    return samples.room()[:, None] * domain.basis(samples.tilt_centres)
