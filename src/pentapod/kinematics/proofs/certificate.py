"""Proof in continuous time that a motion of the legs stays in its component (kinematics notes, section 7).

Between two setpoints the legs are polynomials of degree k in time. So are the squared legs (2k), hence q, py,
u, v, and both discriminants, w² = 1 − u² − v² (4k) and S² = R²|n|² − c² (8k). Where both are positive on a
whole interval, the four assembly modes exist throughout and never meet, and none can turn into another.
Positivity is read off Bernstein coefficients, with subdivision, and holds in spite of rounding:
see `_roundings`. Lemmas 3, 4 and 6 of docs/proofs.md. The kernel works in scaled Bernstein form (`numerics.bernstein`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, as_batch, set_frozen
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.kinematics.batches import as_motion
from pentapod.kinematics.component import Component, as_component
from pentapod.kinematics.forward.quadratic import LinearPart
from pentapod.kinematics.proof_results import ProofResult
from pentapod.kinematics.tubes.leg_equations import QuadraticLegs
from pentapod.numerics.balls import Ball
from pentapod.numerics.bernstein import binomials
from pentapod.numerics.blocks import blocks
from pentapod.numerics.positivity import Positivity, positivity

METHOD = "by Bernstein coefficients of the discriminants of the forward kinematics, rounded outwards"
"""As a user reads it."""

_UNIT_ROUNDOFF = 2.0**-53
_ENTRY = _UNIT_ROUNDOFF  # share by which an entry of the linear map may be off: each is rounded once
_SANE = (1e-40, 1e40)  # metres; within these nothing below can underflow or overflow to harm


@dataclass(frozen=True, eq=False)
class Discriminants:
    """w² and S² as polynomials in time, of N intervals with legs of degree k; computed, with rounding errors.

    w_squared (N, 4k + 1) and s_squared (N, 8k + 1), metres²: Bernstein coefficients of w² = 1 − u² − v² and
    S² = R²|n|² − c². largest (5, N): the largest |coefficient| of each leg, metres. tops (6, N): that of py, u, v,
    R², |n|², c; only where asked for.
    """

    linear: LinearPart
    delta: float
    degree: int
    w_squared: Floats
    s_squared: Floats
    largest: Floats
    tops: Floats

    @classmethod
    def of(cls, pentapod: QuadraticLegs, legs: Floats, *, tops: bool) -> Discriminants:
        """Return them for Bernstein coefficients of the legs (N, 5, k + 1), metres."""
        from pentapod.kinematics.proofs.discriminants_kernels import discriminants  # noqa: PLC0415

        linear, delta, k, count = pentapod.linear_part, pentapod.delta, legs.shape[-1] - 1, len(legs)
        d1, d, largest, maxima = (np.empty((n, count)) for n in (4 * k + 1, 8 * k + 1, 5, 6))
        units = (binomials(k), binomials(2 * k), binomials(4 * k), binomials(8 * k))
        discriminants(legs, linear.linear_map, linear.constant, delta, units, tops, d1, d, largest, maxima)
        return cls(linear, delta, k, d1.T, d.T, largest, maxima)


@dataclass(frozen=True, eq=False)
class ComponentProof(Value, ProofResult):
    """What is proven of N intervals, each of a motion of the legs given by polynomials.

    proven (N,): from the pose of `component` at the start of the interval (and from no other: lengths alone
    cannot tell the mirror images apart) the motion is defined and continuous throughout, and stays in
    `component`. Where consecutive intervals join and all are proven, this holds for the whole of them. Legs
    whose setpoints were taken from poses on both sides of a singularity may be proven too: the motion that
    they describe turns back before it. Its forward kinematics in `component` then is not the planned path.
    refuted (N,): proven not to be so: at some time of the interval the polynomials themselves have w² or S² below
    zero, so that the legs have no pose there. What is neither is `undecided`: the motion touches a singularity, or
    comes closer to one than rounding, leg_error and the depth of subdivision can tell.
    w_lower (N,) and s_lower (N,) in metres: proven lower bounds of |w| and |S| over the interval; each is 0
    where its sign is not proven to last.
    doubt (N, 2): first and last time in [0, 1] of the part of the interval that is not proven, NaN where
    all of it is; where it is refuted, a part in which w² or S² falls below zero.
    """

    component: Component
    w_lower: Floats
    s_lower: Floats
    proven: Bools
    refuted: Bools
    doubt: Floats

    def __post_init__(self) -> None:
        for array in (self.w_lower, self.s_lower, self.proven, self.refuted, self.doubt):
            array.flags.writeable = False
        set_frozen(self, component=Component(*(int(sign) for sign in self.component)))


def certify_component(
    pentapod: QuadraticLegs,
    leg_coefficients: ArrayLike,
    component: ArrayLike,
    *,
    leg_error: float = 0.0,
    depth: int = 16,
) -> ComponentProof:
    """Prove, interval by interval, that a motion of the legs stays in a component.

    leg_coefficients (N, 5, k + 1): Bernstein coefficients in metres of each leg on each interval (for legs
    linear between setpoints: both setpoints). component: a `Component` or two signs. leg_error: metres by
    which each actual leg may differ from its polynomial at any time (following error, rounded setpoints): the
    claim then holds for every such continuous motion. depth: how often an interval may be halved before it is
    given up.

    The bounds are rigorous for the machine whose base attachments and delta are the given floating-point
    numbers and whose offsets are exactly proportional; the coefficients count as exact. Only the squares of
    the legs enter: that lengths are positive is for the strokes to say. An interval with NaN in it is
    undecided.
    Raises ArrayError for a wrong shape, signs other than ±1, a negative leg_error or depth.
    """
    coefficients, named = as_motion(as_batch(leg_coefficients, "leg_coefficients")), as_component(component)
    if not (leg_error >= 0.0 and depth >= 0):
        raise ArrayError("leg_error and depth must not be negative", value=(leg_error, depth))
    count = len(coefficients)
    squares, refuted, doubt = np.zeros((2, count)), np.zeros(count, dtype=np.bool_), np.full((count, 2), np.nan)
    with np.errstate(invalid="ignore", over="ignore", under="ignore"):
        for block in blocks(count, 2048):
            rows = np.arange(block.start, block.stop)
            for close in (False, True):  # the close bound costs more, and few intervals need it
                answers = _answers(pentapod, coefficients[rows], leg_error, depth, close=close)
                for row, answer in zip(squares, answers, strict=True):
                    row[rows] = np.maximum(row[rows], answer.low)
                refuted[rows], doubt[rows] = _joined(*answers)
                rows = rows[((squares[:, rows] <= 0.0).any(axis=0)) & ~refuted[rows]]
                if leg_error == 0.0 or not rows.size:
                    break
        roots = np.nextafter(np.sqrt(squares), 0.0)  # rounded to nearest: one step down is below the root
    return ComponentProof(named, roots[0], roots[1], np.asarray((roots > 0.0).all(axis=0)), refuted, doubt)


def _joined(w: Positivity, s: Positivity) -> tuple[Bools, Floats]:
    """Return where w² or S² is refuted (N,), and the doubtful part (N, 2): the refuted one's, or both together."""
    low, high = np.fmin(w.doubt[:, 0], s.doubt[:, 0]), np.fmax(w.doubt[:, 1], s.doubt[:, 1])
    both = np.stack([low, high], axis=1)
    doubt = np.where(w.refuted[:, None], w.doubt, np.where(s.refuted[:, None], s.doubt, both))
    return w.refuted | s.refuted, doubt


def _roundings(k: int) -> tuple[int, int]:
    """Return m1, m2: how many roundings at most act on any product of inputs in w² and S², legs of degree k.

    Both are computed by additions, subtractions and multiplications only. Let every subtraction be an
    addition and every number its absolute value: that expression has a value A ≥ 0, and the computed result
    is within γ_m A of the exact one, γ_m = m u / (1 − m u), u = 2⁻⁵³, where no product of inputs passes
    through more than m roundings (Higham, "Accuracy and Stability of Numerical Algorithms", section 3.1: each
    rounding multiplies by 1 + δ, |δ| ≤ u). In scaled Bernstein form a product of degrees a ≤ b costs 1 + a
    roundings, and one more for binomials, counted though they are exact up to 2⁵³.

        scaling 1, twice; l² : 2 + 1 + k = k + 3
        linear map (entries rounded once, five products, summed in any order, plus a constant):
        1 + 1 + 4 + 1 more, r = k + 10, for q, py, u, v
        u², v², py², v·py : 2r + 1 + 2k = 4k + 21          w² = 1 − u² − v² : 4k + 23
        R² = l3² (elevated: k + 3 + 2 + 2k) − py² : 4k + 22    |n|² : δ²(1 − v²) 4k + 24, sum 4k + 25
        c = q (elevated) + δ (v·py) : 4k + 23
        R²|n|² : 8k + 47 + 1 + 4k = 12k + 48          S² = R²|n|² − c² : 12k + 49
        dividing by the binomial: 2 more; subtracting the error from the result: 1 more

    Fused multiply-adds only leave roundings out. The halvings of the subdivision add n each for degree n.
    """
    return 4 * k + 26, 12 * k + 52


def _gamma(roundings: int) -> float:
    """γ_m, a hundredth larger: A itself is computed, within far less than that of its exact value."""
    return 1.01 * roundings * _UNIT_ROUNDOFF


def _answers(
    pentapod: QuadraticLegs, legs: Floats, leg_error: float, depth: int, *, close: bool
) -> tuple[Positivity, Positivity]:
    """Return whether w² and S² are positive over each interval, with a quick or a close bound of what errors do."""
    forms = Discriminants.of(pentapod, legs, tops=leg_error > 0.0)
    k, delta, linear, largest = forms.degree, forms.delta, forms.linear, forms.largest
    sane = np.asarray(((largest >= _SANE[0]) & (largest <= _SANE[1])).all(axis=0))

    # A of `_roundings`. The maxima of the coefficients bound every coefficient of a product.
    l3_abs = np.square(largest[2])
    q_abs, py_abs, u_abs, v_abs = linear.largest(np.square(largest))
    d1_abs = 1.0 + u_abs * u_abs + v_abs * v_abs
    n_abs = 1.0 + 2.0 * abs(delta) * u_abs + delta * delta * (1.0 + v_abs * v_abs)
    r_abs, c_abs = l3_abs + py_abs * py_abs, q_abs + abs(delta) * v_abs * py_abs
    d_abs = r_abs * n_abs + c_abs * c_abs

    m1, m2 = _roundings(k)
    d1_rounding, d_rounding = _gamma(m1) * d1_abs, _gamma(m2) * d_abs
    d1_error, d_error = d1_rounding, d_rounding
    if leg_error > 0.0:
        # What any leg within leg_error of its polynomial can add; m2 is more than enough for the maxima, too.
        if close:
            d1_shift, d_shift = _close_shifts(linear, delta, legs, leg_error)
        else:
            tops = forms.tops + _gamma(m2) * np.stack([py_abs, u_abs, v_abs, r_abs, n_abs, c_abs])
            l_shift = leg_error * (2.0 * largest + leg_error)
            d1_shift, d_shift = _quick_shifts(abs(delta), linear.changes(l_shift), l_shift[2], tops)
        d1_error = d1_rounding + 1.001 * d1_shift  # 0.001: the rounding of the shifts themselves
        d_error = d_rounding + 1.001 * d_shift
    w_squared, s_squared = forms.w_squared, forms.s_squared
    if not sane.all():
        w_squared = np.where(sane[:, None], w_squared, np.nan)
    return (
        positivity(w_squared, d1_error, _gamma(4 * k) * d1_abs, depth, d1_rounding),
        positivity(s_squared, d_error, _gamma(8 * k) * d_abs, depth, d_rounding),
    )


def _quick_shifts(delta: float, forms: Floats, l3: Floats, tops: Floats) -> tuple[Floats, Floats]:
    """Return how far w² and S² move (N,) when q, py, u, v move by `forms` (4, N) and l3² by `l3` (N,).

    tops: the largest |py|, |u|, |v|, |R²|, |n|², |c| of each interval. |(a + da)² − a²| ≤ da (2|a| + da).
    """
    q, py, u, v = forms
    py_top, u_top, v_top, r_top, n_top, c_top = tops
    u_squared, v_squared = u * (2.0 * u_top + u), v * (2.0 * v_top + v)
    r = l3 + py * (2.0 * py_top + py)
    n = 2.0 * delta * u + delta * delta * v_squared
    c = q + delta * (v_top * py + py_top * v + v * py)
    return u_squared + v_squared, r_top * n + n_top * r + r * n + c * (2.0 * c_top + c)


def _close_shifts(linear: LinearPart, delta: float, legs: Floats, leg_error: float) -> tuple[Floats, Floats]:
    """Return how far w² and S² move (N,) when each leg of N intervals is off by up to leg_error, metres.

    legs (N, 5, k + 1): Bernstein coefficients. By the mean value theorem in the squared legs: the sum over the legs of
    the steepest slope on all squared legs that may occur, times how far the squared leg moves. The slopes keep their
    signs until the forms are summed, so what cancels does so here, unlike in `_quick_shifts`.
    """
    low, high = legs.min(axis=2).T, legs.max(axis=2).T
    polynomials = Ball.between(Ball.exact(low), Ball.exact(high))
    actual = polynomials.widened(leg_error)
    squares = actual * actual
    entries = Ball(linear.linear_map, _ENTRY * np.abs(linear.linear_map))
    constant = Ball(linear.constant, _ENTRY * np.abs(linear.constant))
    q, py, u, v = (
        sum((entries[f, i] * squares[i] for i in range(len(squares.mid))), constant[f]) for f in range(len(entries.mid))
    )
    r, n = squares[2] - py * py, 1.0 - 2.0 * delta * u + (1.0 - v * v) * (delta * delta)
    c = q + v * py * delta
    s_slopes = (
        -2.0 * c,
        -2.0 * (py * n) - 2.0 * delta * (c * v),
        -2.0 * delta * r,
        -2.0 * delta * (delta * (v * r) + c * py),
    )
    w_slopes = (-2.0 * u, -2.0 * v)
    moves = leg_error * (2.0 * polynomials.magnitude + leg_error)
    w, s = np.zeros(len(legs)), np.zeros(len(legs))
    for i, move in enumerate(moves):
        s_slope = sum((slope * entries[f, i] for f, slope in enumerate(s_slopes)), n if i == 2 else Ball.exact(0.0))
        w_slope = sum((slope * entries[2 + f, i] for f, slope in enumerate(w_slopes)), Ball.exact(0.0))
        w += w_slope.magnitude * move
        s += s_slope.magnitude * move
    return w, s
