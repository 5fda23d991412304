"""The largest singularity-free sphere about a pose: one distance for shifting and turning together.

Metric: d² = (1/5) Σ |Δb_i|², the mean square movement of the five platform joints (A. Rasoulzadeh and G. Nawratil,
"Rational parametrization of linear pentapod's singularity variety and the distance to it", 2017). With c the joints'
centroid and σ the standard deviation of the offsets it is |Δc|² + σ² |Δi|².

The minimum over one angle *(derived)*. In the xz plane let (X, Z) be the centroid, shifted along x by (lever − z̄)/δ;
then S/δ = Z/δ + w X − u Z. Write (X, Z) = ρ (cos φ, sin φ): S vanishes where the direction lies on the circle
N·i = −sin φ/δ, N = (−sin φ, 0, cos φ), whatever ρ is. For a fixed φ position and direction therefore part:

    d²(φ) = (X sin φ − Z cos φ)² + 4 σ² sin²((β − γ)/2),   cos β = N·i,   cos γ = −sin φ/δ.

d² is a trigonometric polynomial in ψ = 2φ minus the root of another one, so its stationary points are among the eight
roots of one of degree 4: all are found, hence the global minimum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, Ints
from pentapod.base.values import Value
from pentapod.kinematics.batches import joined_poses
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.numerics.blocks import blocks

_GRID = 32  # angles tried besides the eight roots, should roots coincide


@dataclass(frozen=True, eq=False)
class SingularityFreeSphere(Value):
    """Spheres about poses (...) that hold no singular pose, and the singular pose that each touches.

    radius (...): metres, in the metric d² = (1/5) Σ |Δb_i|²; 0 on a singularity, NaN for a pose that is NaN.
    position, direction (..., 3): the nearest singular pose, machine frame. surface (...): 0 where that one has w = 0,
    1 where it has S = 0.
    """

    radius: Floats
    position: Floats
    direction: Floats
    surface: Ints

    def __post_init__(self) -> None:
        for array in (self.radius, self.position, self.direction, self.surface):
            array.flags.writeable = False


def singularity_free_sphere(
    pentapod: LinearPentapod, position: ArrayLike, direction: ArrayLike
) -> SingularityFreeSphere:
    """Return the largest sphere about each pose (..., 3) without a singular pose in it, in d² = (1/5) Σ |Δb_i|².

    Every rigid displacement of the platform that moves its joints by less than `radius` (root mean square) leaves the
    pose in its component. Machine frame, metres; direction is unit. The radius is accurate to 1e-12 of the distance
    of the pose from the base. Source: see the head of this file.
    """
    p, i = joined_poses(position, direction)
    batch = p.shape[:-1]
    p, i = p.reshape(-1, 3), i.reshape(-1, 3)
    mean, spread = float(pentapod.offsets.mean()), float(pentapod.offsets.std())
    radius, at, along = np.full(len(p), np.nan), np.full((len(p), 3), np.nan), np.full((len(p), 3), np.nan)
    surface = np.zeros(len(p), dtype=np.intp)
    known = np.flatnonzero(np.isfinite(p).all(axis=1) & np.isfinite(i).all(axis=1))
    shift = np.array([(pentapod.lever - mean) / pentapod.delta, 0.0, 0.0])
    for block in blocks(len(known), 1024):
        rows = known[block]
        centre, line = p[rows] + mean * i[rows], i[rows]
        flat, equator = _to_equator(line, spread)
        tilted, foot, cone = _to_surface(centre + shift, line, spread, 1.0 / pentapod.delta)
        first = flat <= tilted
        radius[rows] = np.where(first, flat, tilted)
        along[rows] = np.where(first[:, None], equator, cone)
        at[rows] = np.where(first[:, None], centre, foot - shift) - mean * along[rows]
        surface[rows] = np.where(first, 0, 1)
    return SingularityFreeSphere(
        radius.reshape(batch), at.reshape(*batch, 3), along.reshape(*batch, 3), surface.reshape(batch)
    )


def _to_equator(line: Floats, spread: float) -> tuple[Floats, Floats]:
    """Return the distance (N,) to w = 0, which leaves the centroid in place, and the direction (N, 3) there."""
    u, v, w = line.T
    flat = np.hypot(u, v)
    safe = np.where(flat == 0.0, 1.0, flat)
    equator = np.stack([np.where(flat == 0.0, 1.0, u / safe), v / safe, np.zeros_like(u)], axis=-1)
    return 2.0 * spread * np.sin(0.5 * np.arctan2(np.abs(w), flat)), equator


def _to_surface(centre: Floats, line: Floats, spread: float, kappa: float) -> tuple[Floats, Floats, Floats]:
    """Return the distance (N,) to S = 0 and the centroid and direction (N, 3) there; kappa = 1/δ, centre shifted."""
    grid = np.linspace(0.0, np.pi, _GRID, endpoint=False) + 0.01
    angles = np.concatenate([_stationary(centre, line, spread, kappa), np.tile(grid, (len(line), 1))], axis=1)
    residual, slope = _residual(angles, centre, line, spread, kappa)
    best = np.argmin((residual**2).sum(axis=0), axis=1)
    rows = np.arange(len(line))
    phi, r, dr = angles[rows, best], residual[:, rows, best], slope[:, rows, best]
    for _ in range(12):  # Gauss-Newton: near a singularity the residual is small, and the roots have too few digits
        norm = (dr * dr).sum(axis=0)
        step = -np.divide((r * dr).sum(axis=0), norm, out=np.zeros_like(norm), where=(norm > 0.0) & np.isfinite(norm))
        shorter = phi[:, None] + step[:, None] * np.array([1.0, 0.3, 0.05])
        tried, tried_slope = _residual(shorter, centre, line, spread, kappa)
        squares = (tried**2).sum(axis=0)
        pick = np.argmin(squares, axis=1)
        better = squares[rows, pick] < (r**2).sum(axis=0)
        phi = np.where(better, shorter[rows, pick], phi)
        r = np.where(better, tried[:, rows, pick], r)
        dr = np.where(better, tried_slope[:, rows, pick], dr)
        if not better.any():
            break
    return np.sqrt((r**2).sum(axis=0)), *_foot(phi, centre, line, kappa)


def _residual(phi: Floats, centre: Floats, line: Floats, spread: float, kappa: float) -> tuple[Floats, Floats]:
    """Return the two parts of d (2, N, M) at angles (N, M) and their derivatives; infinite where no circle is."""
    (x, _, z), (u, v, w) = centre.T[..., None], line.T[..., None]
    s, c = np.sin(phi), np.cos(phi)
    along, across = w * c - u * s, np.hypot(v, u * c + w * s)  # cos β and sin β
    inside = 1.0 - (kappa * s) ** 2
    root = np.sqrt(np.maximum(inside, 0.0))
    half = 0.5 * (np.arctan2(across, along) - np.arctan2(root, -kappa * s))
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = (u * c + w * s) / across - kappa * c / root
        slope = np.stack([x * c + z * s, spread * np.cos(half) * turn])
    residual = np.stack([x * s - z * c, 2.0 * spread * np.sin(half)])
    return np.where(inside >= 0.0, residual, np.inf), np.where(inside >= 0.0, slope, 0.0)


def _foot(phi: Floats, centre: Floats, line: Floats, kappa: float) -> tuple[Floats, Floats]:
    """Return the nearest singular centroid and direction (N, 3) for the angle (N,)."""
    s, c = np.sin(phi), np.cos(phi)
    rho = centre[:, 0] * c + centre[:, 2] * s
    foot = np.stack([rho * c, centre[:, 1], rho * s], axis=-1)
    normal = np.stack([-s, np.zeros_like(s), c], axis=-1)
    aside = line - (line * normal).sum(axis=-1, keepdims=True) * normal
    length = np.linalg.norm(aside, axis=-1, keepdims=True)
    aside = np.where(length > 0.0, aside / np.where(length > 0.0, length, 1.0), (0.0, 1.0, 0.0))
    cosine = (-kappa * s)[:, None]
    return foot, cosine * normal + np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) * aside


_SAMPLES = 2.0 * np.pi * np.arange(16) / 16


def _stationary(centre: Floats, line: Floats, spread: float, kappa: float) -> Floats:
    """Return eight angles φ (N, 8) among which are all where d² is stationary.

    With ψ = 2φ, d² = T − 2σ²√R, T of degree 1 and R = R1 R2 of degree 2 in ψ: T'² R = σ⁴ R'², of degree 4. Taken at 16
    angles its Fourier coefficients are exact; τ = tan((ψ − ψ0)/2) makes it a polynomial of degree 8 whose leading
    coefficient is its value at ψ0 + π, where it is largest.
    """
    (x, _, z), (u, _, w) = centre.T[..., None], line.T[..., None]
    variance = spread * spread
    scale = np.maximum(x * x + z * z, variance)
    cos, sin = np.cos(_SAMPLES), np.sin(_SAMPLES)
    a = (0.5 * (z * z - x * x) + variance * kappa * u) / scale
    b = (variance * kappa * w - x * z) / scale
    r1 = 1.0 - 0.5 * (u * u * (1.0 - cos) - 2.0 * u * w * sin + w * w * (1.0 + cos))
    dr1 = 0.5 * (w * w - u * u) * sin + u * w * cos
    r2, dr2 = 1.0 - 0.5 * kappa**2 * (1.0 - cos), -0.5 * kappa**2 * sin
    values = (b * cos - a * sin) ** 2 * r1 * r2 - (variance / scale * (dr1 * r2 + r1 * dr2)) ** 2
    top = np.argmax(np.abs(values), axis=1)
    rolled = np.take_along_axis(values, (np.arange(16) + top[:, None] + 8) % 16, axis=1)  # the largest at ψ = π
    fourier = np.fft.rfft(rolled, axis=1)[:, :5] / 16.0
    powers = fourier.real @ _COSINES + fourier.imag @ _SINES
    lead = powers[:, -1:]
    flat = np.abs(lead) <= 1e-300  # the same distance for every angle: any will do
    companion = np.zeros((len(line), 8, 8))
    companion[:, np.arange(1, 8), np.arange(7)] = 1.0
    companion[:, :, -1] = np.where(flat, 0.0, -powers[:, :-1] / np.where(flat, 1.0, lead))
    return np.arctan(np.linalg.eigvals(companion).real) + 0.5 * _SAMPLES[(top + 8) % 16][:, None]


def _half_angle_basis() -> tuple[Floats, Floats]:
    """Return (5, 9) twice: the powers of τ in (1 + τ²)⁴ times 2 cos kψ (1 for k = 0), and times −2 sin kψ."""
    cosines, sines = np.zeros((5, 9)), np.zeros((5, 9))
    for k in range(5):
        turned, rest = polynomial.polypow([1.0, 1.0j], 2 * k), polynomial.polypow([1.0, 0.0, 1.0], 4 - k)
        power = polynomial.polymul(turned, rest)
        weight = 1.0 if k == 0 else 2.0
        cosines[k], sines[k] = weight * power.real, -weight * power.imag
    return cosines, sines


_COSINES, _SINES = _half_angle_basis()
