"""Samples of the work volume: tips and tool axes, with the border, where the worst poses are."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.parts import WorkVolume


def sample_work_volume(volume: WorkVolume, *, rings: int, around: int, levels: int) -> tuple[Floats, Floats]:
    """Return tips (N, 3) in metres and tool axes tip → spindle (N, 3): every tip with every axis.

    Tips: the cylinder's axis and `rings` circles of `around` points, on `levels` heights. Axes: −z and as
    many circles in the cone. Both include the boundary, where the worst poses are. Machine frame.
    """
    turn = 2.0 * np.pi * np.arange(around) / around
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    radii = np.arange(1, rings + 1) / rings
    disc = np.concatenate([np.zeros((1, 2)), (radii[:, None, None] * circle).reshape(-1, 2)])
    heights = volume.height * (np.linspace(-0.5, 0.5, levels) if levels > 1 else np.zeros(1))
    tips = np.empty((levels, len(disc), 3))
    tips[..., :2] = 0.5 * volume.diameter * disc
    tips[..., 2] = heights[:, None]
    lean = np.linalg.norm(disc, axis=1) * volume.tilt
    # sin(a)/a · disc keeps the direction −z free of a division by zero.
    across = disc * (volume.tilt * np.sinc(lean / np.pi))[:, None]
    axes = np.concatenate([across, -np.cos(lean)[:, None]], axis=1)
    tips = tips.reshape(-1, 3) + volume.centre
    return np.repeat(tips, len(axes), axis=0), np.tile(axes, (len(tips), 1))
