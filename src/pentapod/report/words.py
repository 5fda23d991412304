"""Numbers, durations, tools and placements as text."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pentapod.base.tables import TomlTable
from pentapod.geometry.rigid import RigidTransform


def number(value: float | None, unit: str = "") -> str:
    """Return a number with its unit, in 4 digits (6 from 1000 on); a dash for None."""
    if value is None:
        return "–"
    digits = 6 if abs(value) >= 1000 else 4
    return f"{value:.{digits}g} {unit}".replace("-", "−").rstrip()


def duration(seconds: float) -> str:
    """Return a time as "1 h 02 min", "3 min 05 s" or "28.1 s"."""
    if seconds >= 3600:
        return f"{int(seconds // 3600)} h {int(seconds % 3600 // 60):02d} min"
    if seconds >= 60:
        return f"{int(seconds // 60)} min {int(seconds % 60):02d} s"
    return f"{seconds:.3g} s"


def job_title(path: Path) -> str:
    """Return what pages call a job: the name of its file, or that of its folder where the file is job.toml."""
    return path.stem if path.stem != "job" else path.resolve().parent.name or path.stem


def opening(sentence: str, most: int = 100) -> str:
    """Return the beginning of a long sentence: up to its first semicolon, or whole words up to `most` characters."""
    first = sentence.split(";", maxsplit=1)[0]
    if len(first) <= most:
        return first
    return first[:most].rsplit(" ", 1)[0].rstrip(" ,:") + " …"


def tool_sentence(tool: TomlTable) -> str:
    """Return the type of the job's tool and its sizes, as text."""
    measures = [f"{key.removesuffix('_mm')} {value:g} mm" for key, value in tool.sizes().items()]
    return ", ".join([f"{tool.type} tool", *measures])


def placement_sentences(transform: RigidTransform) -> list[str]:
    """Return the placement in sentences for the operator."""
    x, y, z = 1e3 * transform.translation
    up = transform.rotation[:, 2]
    lean = float(np.degrees(np.arccos(np.clip(-up[2], -1.0, 1.0))))
    sentences = [
        f"The origin of the mesh is {abs(z):.2f} mm {'below' if z >= 0.0 else 'above'} the base plane, "
        f"at x = {x:.2f} mm, y = {y:.2f} mm.".replace("-", "−")
    ]
    if lean < 0.005:
        sentences.append("Its z axis points straight up to the base.")
    else:
        azimuth = float(np.degrees(np.arctan2(up[1], up[0])))
        sentences.append(
            f"Its z axis is tilted {lean:.2f}° from straight up, towards {azimuth:.1f}° (0° is the machine's x, "
            "90° its y).".replace("-", "−")
        )
    ahead = transform.rotation[:, 0]
    turn = float(np.degrees(np.arctan2(ahead[1], ahead[0])))
    sentences.append(f"Its x axis points towards {turn:.1f}° in plan.".replace("-", "−"))
    return sentences
