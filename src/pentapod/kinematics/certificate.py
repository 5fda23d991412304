"""A proof in continuous time that a motion of the legs stays in its component (kinematics notes, section 7).

Between two setpoints the legs are polynomials of degree k in time. So are the squared legs (2k), hence q, py,
u, v, and both discriminants, w² = 1 − u² − v² (4k) and S² = R²|n|² − c² (8k). Where both are positive on a
whole interval, the four assembly modes exist throughout and never meet, and none can turn into another.
Positivity is read off Bernstein coefficients, with subdivision, and holds in spite of rounding:
see `_roundings`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.arrays import Bools, Floats, as_batch, set_frozen
from pentapod.errors import ArrayError
from pentapod.geometry.bernstein import binomials, convolve, scaled, unscaled
from pentapod.geometry.positivity import lower_bounds
from pentapod.kinematics.blocks import blocks
from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.kinematics.pentapod import LinearPentapod
from pentapod.kinematics.quadratic import LinearPart

_UNIT_ROUNDOFF = 2.0**-53
_SANE = (1e-40, 1e40)  # metres; within these nothing below can underflow or overflow to harm


@dataclass(frozen=True, eq=False)
class ComponentProof:
    """What is proven of N intervals, each of a motion of the legs given by polynomials.

    proven (N,): from the pose of `component` at the start of the interval (and from no other: lengths alone
    cannot tell the mirror images apart) the motion is defined and continuous throughout, and stays in
    `component`. Where consecutive intervals join and all are proven, this holds for the whole of them. Legs
    whose setpoints were taken from poses on both sides of a singularity may be proven too: the motion that
    they describe turns back before it. Its forward kinematics in `component` then is not the planned path.
    w_lower (N,) and s_lower (N,) in metres: proven lower bounds of |w| and |S| over the interval; each is 0
    where its sign is not proven to last: the interval touches that singularity, leaves the component, loses
    the pose altogether, or comes closer to one of these than rounding and the depth of subdivision can tell.
    """

    component: Component
    w_lower: Floats
    s_lower: Floats
    proven: Bools

    def __post_init__(self) -> None:
        for array in (self.w_lower, self.s_lower, self.proven):
            array.flags.writeable = False
        set_frozen(self, component=Component(*(int(sign) for sign in self.component)))

    @property
    def holds(self) -> bool:
        """Whether every interval is proven."""
        return bool(self.proven.all())


def certify_component(
    pentapod: LinearPentapod,
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
    the legs enter: that lengths are positive is for the strokes to say. An interval with NaN in it is not
    proven.
    Raises ArrayError for a wrong shape, signs other than ±1, a negative leg_error or depth.
    """
    coefficients = as_batch(leg_coefficients, "leg_coefficients", (None, 5, None))
    if coefficients.ndim != 3 or coefficients.shape[-1] < 1:
        raise ArrayError(f"leg_coefficients has shape {coefficients.shape}", expected="shape (N, 5, k + 1)")
    if not (leg_error >= 0.0 and depth >= 0):
        raise ArrayError("leg_error and depth must not be negative", value=(leg_error, depth))
    squares = np.zeros((2, len(coefficients)))
    with np.errstate(invalid="ignore", over="ignore", under="ignore"):
        for block in blocks(len(coefficients), 2048):
            squares[:, block] = _square_bounds(pentapod, coefficients[block], leg_error, depth)
        roots = np.nextafter(np.sqrt(squares), 0.0)  # rounded to nearest: one step down is below the root
    return ComponentProof(_named(component), roots[0], roots[1], np.asarray((roots > 0.0).all(axis=0)))


def _named(component: ArrayLike) -> Component:
    signs = as_batch(component, "component", (2,))
    for candidate in COMPONENTS:
        if signs.shape == (2,) and tuple(signs) == candidate:
            return candidate
    raise ArrayError("component must be one pair of signs", value=signs.tolist(), expected="+1 or −1 for w and for S")


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


def _square_bounds(pentapod: LinearPentapod, legs: Floats, leg_error: float, depth: int) -> Floats:
    """Return proven lower bounds (2, N) of w² and S² over intervals (N, 5, k + 1); 0 where there is none."""
    k, delta, linear = legs.shape[-1] - 1, pentapod.delta, pentapod.linear_part
    largest = np.abs(legs).max(axis=-1).T  # (5, N)
    sane = ((largest >= _SANE[0]) & (largest <= _SANE[1])).all(axis=0)
    q, py, u, v, l3 = _linear_forms(linear, legs)

    one = binomials(4 * k)
    d1 = one - convolve(u, u)
    v_squared = convolve(v, v)
    d1 -= v_squared
    r_squared = convolve(l3, binomials(2 * k)) - convolve(py, py)
    n_squared = convolve(binomials(2 * k) - (2.0 * delta) * u, binomials(2 * k))
    n_squared += (delta * delta) * (one - v_squared)
    c = convolve(q, binomials(2 * k)) + delta * convolve(v, py)
    d = convolve(r_squared, n_squared) - convolve(c, c)

    # A of the docstring above. The maxima of the coefficients bound every coefficient of a product.
    q_abs, py_abs, u_abs, v_abs = np.abs(linear.linear_map) @ largest**2 + np.abs(linear.constant)[:, None]
    d1_abs = 1.0 + u_abs * u_abs + v_abs * v_abs
    n_abs = 1.0 + 2.0 * abs(delta) * u_abs + delta * delta * (1.0 + v_abs * v_abs)
    r_abs, c_abs = largest[2] ** 2 + py_abs * py_abs, q_abs + abs(delta) * v_abs * py_abs
    d_abs = r_abs * n_abs + c_abs * c_abs

    m1, m2 = _roundings(k)
    d1_error, d_error = _gamma(m1) * d1_abs, _gamma(m2) * d_abs
    if leg_error > 0.0:
        # What any leg within leg_error of its polynomial can add; m2 is more than enough for the maxima, too.
        pairs = ((py, py_abs), (u, u_abs), (v, v_abs), (r_squared, r_abs), (n_squared, n_abs), (c, c_abs))
        tops = [np.abs(unscaled(form)).max(axis=-1) + _gamma(m2) * bound for form, bound in pairs]
        l_shift = leg_error * (2.0 * largest + leg_error)
        d1_shift, d_shift = _shifts(abs(delta), np.abs(linear.linear_map) @ l_shift, l_shift[2], tops)
        d1_error += 1.001 * d1_shift  # 0.001: the rounding of the shifts themselves
        d_error += 1.001 * d_shift
    bounds = np.stack(
        [
            lower_bounds(unscaled(d1), d1_error, _gamma(4 * k) * d1_abs, depth),
            lower_bounds(unscaled(d), d_error, _gamma(8 * k) * d_abs, depth),
        ]
    )
    return np.where(sane, bounds, 0.0)


def _shifts(delta: float, forms: Floats, l3: Floats, tops: list[Floats]) -> tuple[Floats, Floats]:
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


def _linear_forms(linear: LinearPart, legs: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return q, py, u, v and l3² in scaled form, each (N, 2k + 1), of legs (N, 5, k + 1)."""
    coefficients = scaled(np.swapaxes(legs, 0, 1))
    squared = np.moveaxis(convolve(coefficients, coefficients), -1, 0)  # (2k + 1, 5, N)
    constant = binomials(len(squared) - 1)[:, None, None] * linear.constant[:, None]
    forms = np.moveaxis(linear.linear_map @ squared + constant, 0, -1)
    return forms[0], forms[1], forms[2], forms[3], np.moveaxis(squared[:, 2], 0, -1)
