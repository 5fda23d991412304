"""A machine as built is calibrated: what errors of fractions of a millimetre do to the tip, and what is left of them.

The design is of the quadratic family but for its rings of 12 mm around the tool axis, as in LinuxCNC's pentakins. The
machine that was built has base joints off by half a millimetre, also out of their plane, and offsets, rings and scales
with errors of their own. An instrument
measures it in some poses; `calibrate` finds its thirty numbers. Left: the error of the tip over other poses, when the
controller believes in the design, and when it believes in the calibrated one. Right: each parameter's error
against the standard deviation that the calibration claims for it.

    python examples/08_calibration.py --poses 60 --out docs/calibration.png
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from pentapod.kinematics import AsBuiltPentapod, Component, LinearPentapod, as_built_pose
from pentapod.machine import Calibration, calibrate

BASE = np.array([(0.586, -0.120), (0.224, 0.554), (-0.326, 0.498), (-0.597, -0.039), (-0.055, -0.595)])
NOMINAL = LinearPentapod.quadratic(BASE, 0.185)
DESIGN = AsBuiltPentapod.of(NOMINAL, radii=0.012)
TOOL = 0.198
COMPONENT = Component(1, 1)
LEG_SIGMA, POSITION_SIGMA, DIRECTION_SIGMA = 2e-6, 10e-6, 20e-6
KINDS = ("x", "y", "z", "offset", "radius", "zero")


@dataclass(frozen=True)
class Result:
    """Tip errors (N,) in metres over fresh poses, before and after; how many of those poses are proven; the fit."""

    before: np.ndarray
    after: np.ndarray
    proven: float
    found: Calibration
    real: AsBuiltPentapod


def built(rng: np.random.Generator) -> AsBuiltPentapod:
    """Return a machine with the errors of an honest workshop."""
    return AsBuiltPentapod.of(
        NOMINAL,
        base_errors=rng.normal(size=(5, 3)) * 0.5e-3,
        offset_errors=rng.normal(size=5) * 0.2e-3,
        radii=0.012 + rng.normal(size=5) * 0.1e-3,
        zeros=rng.normal(size=5) * 0.5e-3,
    )


def poses(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and directions (n, 3) of the work volume, tools leaning up to 30 degrees."""
    lean, turn = np.radians(30.0) * np.sqrt(rng.random(n)), rng.uniform(0.0, 2.0 * np.pi, n)
    i = np.stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)], axis=-1)
    tip = rng.uniform((-0.1, -0.1, 0.60), (0.1, 0.1, 0.75), (n, 3))
    return tip - TOOL * i, i


def tip_errors(
    believed: AsBuiltPentapod, real: AsBuiltPentapod, p: np.ndarray, i: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return how far (n,) tips are from where they should be when the legs are set after `believed`; share proven."""
    reached = as_built_pose(real, NOMINAL, believed.leg_lengths(p, i), COMPONENT)
    off = reached.position + TOOL * reached.direction - (p + TOOL * i)
    return np.linalg.norm(off, axis=1), float(reached.proven.mean())


def run(n: int, seed: int) -> Result:
    """Build a machine, measure it in n poses, calibrate it, and judge it in 2000 others."""
    rng = np.random.default_rng(seed)
    real = built(rng)
    p, i = poses(rng, n)
    seen = i + DIRECTION_SIGMA * np.cross(rng.normal(size=i.shape), i)
    found = calibrate(
        p + POSITION_SIGMA * rng.normal(size=p.shape),
        seen / np.linalg.norm(seen, axis=1)[:, None],
        real.leg_lengths(p, i) + LEG_SIGMA * rng.normal(size=(n, 5)),
        DESIGN,
        leg_sigma=LEG_SIGMA,
        position_sigma=POSITION_SIGMA,
        direction_sigma=DIRECTION_SIGMA,
    )
    fresh = poses(rng, 2000)
    before, _ = tip_errors(DESIGN, real, *fresh)
    after, proven = tip_errors(found.machine, real, *fresh)
    return Result(before, after, proven, found, real)


def draw(result: Result, out: str) -> None:
    """Write the picture."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 5.2), layout="constrained")
    bins = np.geomspace(1e-3, 1e1, 81)
    for errors, name in ((result.before, "as designed"), (result.after, "calibrated")):
        label = f"{name}: median {1e3 * np.median(errors):.3g} mm, worst {1e3 * errors.max():.3g} mm"
        left.hist(1e3 * errors, bins, alpha=0.7, label=label)
    left.set(xscale="log", xlabel="error of the tip (mm)", ylabel="poses", title="2000 poses that were not measured")
    left.legend(loc="upper left")
    true, fitted = (np.c_[m.base, m.offsets, m.radii, m.zeros] for m in (result.real, result.found.machine))
    sigma = np.sqrt(np.diag(result.found.covariance)).reshape(5, 6)
    for k, kind in enumerate(KINDS):
        right.loglog(1e6 * sigma[:, k], 1e6 * np.abs(fitted - true)[:, k], "o", label=kind)
    ends = np.array([0.5 * sigma[sigma > 0].min(), 2.0 * sigma.max()]) * 1e6
    for factor, style in ((1.0, "k-"), (2.0, "k--")):
        right.loglog(ends, factor * ends, style, linewidth=0.8)
    right.set(xlabel="claimed standard deviation (µm)", ylabel="error (µm)", title="thirty numbers; lines at σ and 2σ")
    right.legend(ncols=2)
    figure.savefig(out, dpi=100)
    plt.close(figure)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", default="docs/calibration.png")
    arguments = parser.parse_args()
    result = run(arguments.poses, arguments.seed)
    before, after = (1e3 * float(np.median(errors)) for errors in (result.before, result.after))
    print(
        f"identified {len(result.found.identified)} of 30 parameters, {100 * result.proven:.2f} % of the poses proven"
    )
    print(f"tip error, median: {before:.3f} mm before, {after:.4f} mm after")
    draw(result, arguments.out)


if __name__ == "__main__":
    main()
