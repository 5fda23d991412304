"""Write the sample CAM files of `toolpaths/cam`: `python toolpaths/make_cam.py [FOLDER]`; same bytes every time.

Five passes over the dome with a ball of 6 mm, as posts of CAM systems write them: G-code with three axes, G-code with
tool centre point programming on a table that turns about A and C, and APT. The tool follows the sphere in closed form.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

BALL, SLOPE = 3.0, np.radians(40.0)
SPHERE = 75.0 / np.sin(SLOPE)
"""Radius of the ball and of the dome, mm."""

CLEAR, FEED = 60.0, 1500
"""Height of rapids, mm; feed of cuts, mm/min."""


def passes() -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield contacts (N, 3) in mm and normals (N, 3) of each pass, to and fro."""
    for k, y in enumerate((-20.0, -10.0, 0.0, 10.0, 20.0)):
        x = np.linspace(-40.0, 40.0, 41)[:: -1 if k % 2 else 1]
        contact = np.stack([x, np.full_like(x, y), np.sqrt(SPHERE**2 - x**2 - y**2)], axis=1)
        yield contact - [0.0, 0.0, SPHERE * np.cos(SLOPE)], contact / SPHERE


def three_axes() -> str:
    """Return G-code with three axes: the tool upright, the ball on the surface."""
    lines = ["%", "O1001 (DOME, BALL 6 MM, THREE AXES)", "G90 G94 G17 G21 G40 G49 G80", "G54", "T1 M6", "S12000 M3"]
    for contacts, normals in passes():
        tips = contacts + BALL * (normals - [0.0, 0.0, 1.0])
        x, y, z = tips[0]
        lines += [f"G0 X{x:.4f} Y{y:.4f}", f"G43 Z{CLEAR:.1f} H1" if len(lines) == 6 else f"Z{CLEAR:.1f}"]
        lines += [f"G1 Z{z:.4f} F500", *(f"X{x:.4f} Y{y:.4f} Z{z:.4f} F{FEED}" for x, y, z in tips[1:])]
        lines.append(f"G0 Z{CLEAR:.1f}")
    return "\n".join([*lines, "M5", "M30", "%", ""])


def five_axes() -> str:
    """Return G-code with tool centre point programming, axes A and C: the tool along the surface's normal."""
    lines = ["%", "O1002 (DOME, BALL 6 MM, TABLE A C)", "G90 G94 G17 G21 G40 G49 G80", "G54", "T1 M6", "S12000 M3"]
    for contacts, normals in passes():
        a = np.degrees(np.arccos(normals[:, 2]))
        c = np.degrees(np.unwrap(np.arctan2(normals[:, 0], -normals[:, 1])))
        start = contacts[0] + CLEAR * normals[0]
        on = "G43.4 H1 " if len(lines) == 6 else ""
        turn = f"A{a[0]:.4f} C{c[0]:.4f}"
        lines += [f"G0 {turn}", f"{on}X{start[0]:.4f} Y{start[1]:.4f} Z{start[2]:.4f} {turn}"]
        for k, (x, y, z) in enumerate(contacts):
            lines.append(f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} A{a[k]:.4f} C{c[k]:.4f} F{FEED if k else 500}")
        end = contacts[-1] + CLEAR * normals[-1]
        lines.append(f"G0 X{end[0]:.4f} Y{end[1]:.4f} Z{end[2]:.4f}")
    return "\n".join([*lines, "G49", "M5", "M30", "%", ""])


def apt() -> str:
    """Return APT with tool axes along the surface's normal."""

    def goto(tip: np.ndarray, axis: np.ndarray) -> str:
        return "GOTO/" + ",".join([*(f"{value:.4f}" for value in tip), *(f"{value:.7f}" for value in axis)])

    lines = ["PARTNO/DOME", "UNITS/MM", "MULTAX/ON", "LOADTL/1", "SPINDL/12000,CLW"]
    for contacts, normals in passes():
        lines += ["RAPID", goto(contacts[0] + CLEAR * normals[0], normals[0])]
        lines += ["FEDRAT/500,MMPM", goto(contacts[0], normals[0]), f"FEDRAT/{FEED},MMPM"]
        lines += [goto(*pose) for pose in zip(contacts[1:], normals[1:], strict=True)]
        lines += ["RAPID", goto(contacts[-1] + CLEAR * normals[-1], normals[-1])]
    return "\n".join([*lines, "FINI", ""])


FILES = {"three_axes.nc": three_axes, "five_axes.nc": five_axes, "dome.apt": apt}


def main() -> None:
    """Write the files."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "cam"
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in FILES.items():
        (folder / name).write_text(text(), encoding="ascii")


if __name__ == "__main__":
    main()
