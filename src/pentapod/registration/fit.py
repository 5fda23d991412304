"""register: the placement of a part that fits touches best, what they leave open, and what else would fit them.

Gauss-Newton on the gaps between the probe's ball and the mesh, robust against outliers. A motion that hardly changes
any gap is not determined: the part stays where the start has it in that respect. Whether it is, is asked of the smooth
surface that the mesh approximates: the facets of a sphere would seem to tell its rotation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import stdtrit

from pentapod.base.arrays import Bools, Floats
from pentapod.base.errors import ArrayError
from pentapod.geometry.rigid import RigidTransform
from pentapod.mesh.query.distance import MeshDistance
from pentapod.registration.contacts import Contacts, motion_rows
from pentapod.registration.motions import named_motions
from pentapod.registration.result import CutSurface, NotRegistered, OtherPlacement, Registration


@dataclass(frozen=True)
class FitOptions:
    """How touches are fitted.

    least: touches at least: six unknowns, and one to see errors by. rounds: steps at most; settled: share by which a
    step must gain; idle: how many may gain less before they end; largest_step: share of the part's size.
    undetermined: change of the gaps for each metre of motion below which a motion counts as undetermined; by_facets:
    the same, for each radian between facets and smooth normals. outlier: standard deviations from which a touch is one;
    floor: metres, the least standard deviation for that; most_outliers: share of them from which the part is not
    believed to be the one touched. suspect: how much larger than by the median the standard deviation may be before
    there are outliers. many: degrees of freedom that count as all. confidence: of the uncertainties. turns: starts
    about the machine's z axis, for the search of other placements; as_good: how much worse those may fit; same:
    how much worse than the best counts as the same; near, near_angle: metres and radians from the start within which
    the part is expected. different: standard deviations by which two placements of the surface differ.
    """

    least: int = 7
    rounds: int = 60
    settled: float = 1e-4
    largest_step: float = 0.25
    idle: int = 3
    undetermined: float = 0.003
    by_facets: float = 0.35
    outlier: float = 4.5
    floor: float = 1e-6
    most_outliers: float = 0.2
    suspect: float = 2.0
    many: float = 1e9
    confidence: float = 0.95
    turns: int = 12
    as_good: float = 2.0
    same: float = 1.1
    near: float = 20e-3
    near_angle: float = float(np.radians(20.0))
    different: float = 8.0


OPTIONS = FitOptions()


@dataclass(frozen=True, eq=False)
class _Fitted:
    """A placement, the gaps there, and the basis (d, 6) of the motions that the touches determine."""

    placement: RigidTransform
    contacts: Contacts
    basis: Floats
    null: Floats

    def merit(self, rows: Bools | None) -> float:
        """Return how far the surface is from the touches (N,) to use, or, less sensitive to outliers, from all."""
        gaps = self.contacts.gaps
        return float(np.abs(gaps).sum()) if rows is None else float(np.square(gaps[rows]).sum())

    @property
    def quality(self) -> float:
        """The gap that all but the share of outliers keep, metres."""
        return float(np.quantile(np.abs(self.contacts.gaps), 1.0 - OPTIONS.most_outliers))


def register(
    surface: MeshDistance,
    centres: Floats,
    radius: float,
    start: RigidTransform,
    cut: CutSurface,
    *,
    noise: float | None = None,
    hold: bool = False,
) -> Registration | NotRegistered:
    """Return the placement at which balls of a probe with centres (N, 3), machine frame, touch the surface.

    surface: of the part; radius: of the ball; start: the planned placement; cut: where the uncertainty is asked. noise:
    standard deviation of a touch where it is known, else it is estimated from the residuals. hold: motions that the
    touches do not determine stay as planned; without it they are a refusal. All lengths in metres. Raises ArrayError
    for too few touches. Refuses touches that fit no placement, or several.
    """
    if len(centres) < OPTIONS.least:
        raise ArrayError(
            "too few touches", key="touches", value=len(centres), expected=f"at least {OPTIONS.least}: six unknowns",
        )  # fmt: skip
    task = _Task(surface, centres, radius)
    found = [task.fitted(one) for one in (start, *task.starts(start))]
    best = min(found, key=lambda fitted: fitted.quality)
    good = [f for f in found if f.quality <= OPTIONS.as_good * max(best.quality, noise or OPTIONS.floor)]
    near = [fitted for fitted in good if task.is_near(start, fitted.placement)] or good
    least = OPTIONS.same * min(fitted.quality for fitted in near)
    nearest = min(
        (fitted for fitted in near if fitted.quality <= least),
        key=lambda fitted: task.apart(start, fitted.placement),
    )
    result = task.result(nearest, cut, noise)
    if len(result.outliers) > OPTIONS.most_outliers * len(centres):
        worst = f"by up to {1e3 * np.abs(result.residuals).max():.3g} mm"
        cause = f"no placement fits: {len(result.outliers)} of {len(centres)} touches are off, {worst}"
        remedy = "Check part, tip diameter, probe length and machine of the touches"
        return NotRegistered("registration", cause, remedy=remedy, found=result)
    result = replace(result, others=() if result.held else task.others(result, good, start, cut))
    twins = [other for other in result.others if other.near]
    if twins:
        cause = f"the touches fit two placements: the other is {twins[0]}"
        return NotRegistered("registration", cause, remedy="Touch the part where the two differ", found=result)
    if result.held and not hold:
        cause = f"the touches do not determine {' and '.join(motion.name for motion in result.held)}"
        return NotRegistered("registration", cause, found=result)
    return result


@dataclass(frozen=True, eq=False)
class _Task:
    """Surface, centres (N, 3) of the balls in the machine frame, and their radius."""

    surface: MeshDistance
    centres: Floats
    radius: float

    @property
    def middle(self) -> Floats:
        return self.surface.bounds.mean(axis=0)

    @property
    def size(self) -> float:
        return 0.5 * float(np.ptp(self.surface.bounds, axis=0).max())

    def starts(self, start: RigidTransform) -> list[RigidTransform]:
        """Return other starts: the part turned on the table, and turned over."""
        middle = start.apply(self.middle)
        angles = 2.0 * np.pi * np.arange(OPTIONS.turns) / OPTIONS.turns
        over = (np.eye(3), np.diag([1.0, -1.0, -1.0]))
        turns = [Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix() @ half for half in over for angle in angles][1:]
        return [RigidTransform(turn @ start.rotation, middle - turn @ start.rotation @ self.middle) for turn in turns]

    def fitted(self, start: RigidTransform, rows: Bools | None = None) -> _Fitted:
        """Return the fit from a start. rows (N,): touches to use; all where there are none."""
        best = self._descended(self._at(start), rows, loose=False)
        if len(best.null):  # far from the part's place a motion may seem open that is determined there
            again = self._descended(best, rows, loose=True)
            return again if len(again.null) < len(best.null) else best
        return best

    def _descended(self, best: _Fitted, rows: Bools | None, *, loose: bool) -> _Fitted:
        """Return the best of Gauss-Newton's steps. loose: along motions that barely change the gaps, too."""
        for kind in ("normals", "gradients"):  # those of the smooth surface lead past the facets' edges
            here, idle = best, 0
            for _ in range(OPTIONS.rounds):
                here = self._stepped(here, kind, rows, loose=loose)
                idle = 0 if here.merit(rows) < (1.0 - OPTIONS.settled) * best.merit(rows) else idle + 1
                best = min(best, here, key=lambda fitted: fitted.merit(rows))
                if idle >= OPTIONS.idle:
                    break
        return best

    def _stepped(self, here: _Fitted, kind: str, rows: Bools | None, *, loose: bool) -> _Fitted:
        """Return the placement after a Gauss-Newton step along the motions that the touches determine."""
        contacts, weights = here.contacts, _weights(here.contacts.gaps, rows)
        jacobian = motion_rows(contacts.points, getattr(contacts, kind), self.middle, self.size)
        basis = np.concatenate([here.basis, here.null]) if loose else here.basis
        a, b = (jacobian @ basis.T) * weights[:, None], contacts.gaps * weights
        step = np.linalg.lstsq(a, b, rcond=OPTIONS.undetermined if loose else None)[0] @ basis
        step *= min(1.0, OPTIONS.largest_step * self.size / max(float(np.abs(step).max(initial=0.0)), 1e-300))
        return self._at(self._moved(here.placement, step))

    def _at(self, placement: RigidTransform) -> _Fitted:
        contacts = Contacts.of(self.surface, placement.inverse().apply(self.centres), self.radius)
        rows = self._telling(contacts)
        _, values, twists = np.linalg.svd(rows)
        off = np.linalg.norm(contacts.normals - contacts.gradients, axis=1)
        limit = max(OPTIONS.undetermined, OPTIONS.by_facets * float(np.sqrt(np.mean(off**2))))
        known = np.append(values, np.zeros(6))[:6] / np.sqrt(len(rows)) > limit
        return _Fitted(placement, contacts, twists[known], twists[~known])

    def _moved(self, placement: RigidTransform, twist: Floats) -> RigidTransform:
        """Return a placement after a motion of the part by a twist (6,), workpiece frame."""
        turn = Rotation.from_rotvec(twist[3:] / self.size).as_matrix()
        u, _, v = np.linalg.svd(placement.rotation @ turn)
        return RigidTransform(u @ v, placement.apply(self.middle + twist[:3]) - u @ v @ self.middle)

    def result(self, fitted: _Fitted, cut: CutSurface, noise: float | None) -> Registration:
        """Return the registration without outliers, from a first fit."""
        rows = kept = np.ones(len(self.centres), dtype=np.bool_)
        for _ in range(OPTIONS.rounds):
            fitted = self.fitted(fitted.placement, rows)
            half, spread = self._variances(fitted, rows), self._noise(fitted, rows, noise)
            a = motion_rows(fitted.contacts.points, fitted.contacts.gradients, self.middle, self.size)
            known = np.einsum("ni,ij,nj->n", a, half, a) * rows  # the share of a touch's variance that it fits itself
            scale = np.maximum(spread * np.sqrt(np.maximum(1.0 - known, 1e-3)), OPTIONS.floor)
            kept = np.abs(fitted.contacts.gaps) <= OPTIONS.outlier * scale
            if (kept == rows).all() or kept.sum() < OPTIONS.least:
                break
            rows = kept
        spread, covariance = self._noise(fitted, rows, noise), self._variances(fitted, rows)
        covariance *= spread**2
        freedom = _freedom(rows, fitted) if noise is None else np.inf
        factor = float(stdtrit(min(freedom, OPTIONS.many), 0.5 + 0.5 * OPTIONS.confidence))
        on_cut = motion_rows(cut.points, cut.normals, self.middle, self.size)
        across = np.sqrt(np.maximum(np.einsum("pi,ij,pj->p", on_cut, covariance, on_cut), 0.0))
        held = named_motions(fitted.null, self.middle, self.size, on_cut)
        return Registration(
            fitted.placement, fitted.contacts.gaps, kept, spread, covariance, across, factor, self.middle, self.size,
            held, (), self._telling(fitted.contacts),
        )  # fmt: skip

    def _telling(self, contacts: Contacts) -> Floats:
        """Return the `motion_rows` (N, 6) that count as knowledge: none of edges, which a wrong start makes up."""
        rows = motion_rows(contacts.points, contacts.normals, self.middle, self.size)
        return np.where(contacts.on_edge[:, None], 0.0, rows)

    def _variances(self, fitted: _Fitted, rows: Bools) -> Floats:
        """Return the covariance (6, 6) of the part's twist for touches of variance 1; motions that are held have none.

        Of the smooth surface: the facets of a mesh would seem to tell more.
        """
        a = self._telling(fitted.contacts)[rows] @ fitted.basis.T
        return np.asarray(fitted.basis.T @ np.linalg.pinv(a.T @ a) @ fitted.basis)

    def _noise(self, fitted: _Fitted, rows: Bools, noise: float | None) -> float:
        """Return the standard deviation of a touch: that which is given, else the residuals', robustly at first."""
        if noise is not None:
            return noise
        gaps, freedom = fitted.contacts.gaps, _freedom(rows, fitted)
        plain = float(np.sqrt(np.square(gaps[rows]).sum() / freedom))
        robust = 1.4826 * float(np.median(np.abs(gaps))) * float(np.sqrt(len(gaps) / _freedom(rows | True, fitted)))
        return max(robust if rows.all() and plain > OPTIONS.suspect * robust else plain, OPTIONS.floor)

    def apart(self, start: RigidTransform, placement: RigidTransform) -> float:
        """Return a distance of placements: of the part's middle, and its turn at the part's size, metres."""
        shift, turn = self.off(start, placement)
        return shift + turn * self.size

    def is_near(self, start: RigidTransform, placement: RigidTransform) -> bool:
        """Return whether a placement is where the part is expected."""
        shift, turn = self.off(start, placement)
        return bool(shift <= OPTIONS.near and turn <= OPTIONS.near_angle)

    def off(self, a: RigidTransform, b: RigidTransform) -> tuple[float, float]:
        """Return how far apart the part's middle is at two placements, metres, and the angle between them, radians."""
        cosine = 0.5 * (np.trace(a.rotation.T @ b.rotation) - 1.0)
        shift = float(np.linalg.norm(a.apply(self.middle) - b.apply(self.middle)))
        return shift, float(np.arccos(np.clip(cosine, -1.0, 1.0)))

    def others(
        self, found: Registration, fits: list[_Fitted], start: RigidTransform, cut: CutSurface
    ) -> tuple[OtherPlacement, ...]:
        """Return the fits at which the cut surface is elsewhere; those that only differ along the surface are none."""
        kept: list[RigidTransform] = [found.placement]
        others: list[OtherPlacement] = []
        least = OPTIONS.different * max(found.noise, float(found.across.max(initial=0.0)), OPTIONS.floor)
        for first in fits:
            if any(self._differ(placement, first.placement, cut) <= least for placement in kept):
                continue
            fit = self.fitted(first.placement, found.used)  # the first fit may have ended early
            if all(self._differ(placement, fit.placement, cut) > least for placement in kept):
                kept.append(fit.placement)
                shift, turn = self.off(found.placement, fit.placement)
                others.append(OtherPlacement(fit.placement, shift, turn, self.is_near(start, fit.placement)))
        if not self.is_near(start, found.placement):  # none is where it was planned
            return tuple(replace(other, near=True) for other in others)
        return tuple(others)

    def _differ(self, a: RigidTransform, b: RigidTransform, cut: CutSurface) -> float:
        """Return by how much the cut surface at placement b is off the part's surface at placement a, metres."""
        points = a.inverse().apply(b.apply(cut.points))
        return float(np.linalg.norm(points - self.surface.feet(points).points, axis=1).max(initial=0.0))


def _freedom(rows: Bools, fitted: _Fitted) -> int:
    """Return how many touches there are beyond the motions that they determine."""
    return max(int(rows.sum()) - len(fitted.basis), 1)


def _weights(gaps: Floats, rows: Bools | None) -> Floats:
    """Return the roots of weights (N,): those of Huber's loss, or 1 for the touches that are used and 0 for others."""
    if rows is not None:
        return rows.astype(np.float64)
    scale = max(1.345 * 1.4826 * float(np.median(np.abs(gaps))), OPTIONS.floor)
    return np.sqrt(np.minimum(1.0, scale / np.maximum(np.abs(gaps), 1e-300)))
