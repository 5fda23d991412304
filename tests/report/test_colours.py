"""Colours of figures: told apart by all who look at them, on white and on dark pages."""

from __future__ import annotations

import itertools
import re
from importlib import resources

import numpy as np
import pytest

from pentapod.report.drawings.colours import KIND_COLOURS, LEG_COLOURS, RAMP

SIGHT = {
    "normal": np.eye(3),
    # Machado, Oliveira and Fernandes (2009), the whole deficiency, on linear red, green and blue.
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
LEAST_DIFFERENCE, LEAST_CONTRAST = 15.0, 3.0


def linear(colour: str) -> np.ndarray:
    values = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def lab(light: np.ndarray) -> np.ndarray:
    ratio = XYZ @ light / XYZ.sum(axis=1)
    f = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(first: str, second: str) -> float:
    low, high = sorted(float(XYZ[1] @ linear(colour)) for colour in (first, second))
    return (high + 0.05) / (low + 0.05)


def grounds() -> list[str]:
    """The sheets of the page, light and dark."""
    style = (resources.files("pentapod.report") / "style.css").read_text(encoding="utf-8")
    return sorted(set(re.findall(r"--sheet: (#\w{6})", style)))


@pytest.mark.parametrize("sight", SIGHT)
@pytest.mark.parametrize("colours", [LEG_COLOURS, KIND_COLOURS], ids=["legs", "kinds"])
def test_colours_are_told_apart(colours, sight):
    seen = [lab(np.clip(np.array(SIGHT[sight]) @ linear(colour), 0.0, 1.0)) for colour in colours]
    assert len(colours) == 6
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) >= LEAST_DIFFERENCE


@pytest.mark.parametrize("colour", [*LEG_COLOURS, *KIND_COLOURS])
def test_lines_stand_out_from_the_page(colour):
    assert len(grounds()) == 2
    assert min(contrast(colour, ground) for ground in grounds()) >= LEAST_CONTRAST


def test_the_worst_is_the_darkest():
    light = [lab(linear(colour))[0] for _, colour in RAMP]
    assert (np.diff(light) > 5.0).all()


def test_the_measure_is_right():
    """White and black; a pair that a deuteranope cannot tell apart."""
    assert contrast("#ffffff", "#000000") == pytest.approx(21.0)
    assert lab(linear("#ff0000")) == pytest.approx([53.24, 80.09, 67.20], abs=0.05)
    pair = [lab(np.clip(np.array(SIGHT["deuteranopia"]) @ linear(c), 0.0, 1.0)) for c in ("#b35a00", "#5c7d00")]
    assert np.linalg.norm(pair[0] - pair[1]) < LEAST_DIFFERENCE
