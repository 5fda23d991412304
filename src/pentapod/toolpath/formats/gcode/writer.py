"""G-code as pentapod writes it: XYZAB for LinuxCNC, XYZBC with G43.4, XYZ with tool axes for Sinumerik."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.toolpath.formats.moves import dwell_times, kind_remark, plain, poses, tilt_centre_remark, words_before
from pentapod.toolpath.formats.rotary import Rotary
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

_LINEAR = ("X", "Y", "Z")


def write_plain(toolpath: Toolpath, rotary: Rotary, *, needs_tcp: bool, inverse_time: bool) -> bytes:
    """Return a toolpath as G-code. needs_tcp: with G43.4; inverse_time: with G93."""
    letters = (*_LINEAR, *rotary.words)
    angles = rotary.angles(toolpath.axes)
    lines = ["%", f"({tilt_centre_remark(toolpath.tilt_centre)})", f"G21 G90 G{93 if inverse_time else 94}"]
    lines += ["G43.4 H1"] if needs_tcp else []
    rows = [
        [letter + value for letter, value in zip(letters, [*tip, *turn], strict=True)]
        for tip, turn in zip(_texts(toolpath.tips * 1e3, 7), _texts(angles, 10), strict=True)
    ]
    lines += _moves(toolpath, rows, comment="({})", dwell="X" if needs_tcp else "P", inverse_time=inverse_time)
    lines += ["G49"] if needs_tcp else []
    return ("\n".join([*lines, "M2", "%"]) + "\n").encode()


def write_sinumerik(toolpath: Toolpath) -> bytes:
    """Return a toolpath as a program of Sinumerik with tool axes (A3, B3, C3)."""
    lines = [f"; {tilt_centre_remark(toolpath.tilt_centre)}", "G710 G90 G94", "TRAORI", "ORIWKS", "ORIVECT"]
    names = ("A3=", "B3=", "C3=")
    rows = [
        [letter + value for letter, value in zip((*_LINEAR, *names), [*tip, *axis], strict=True)]
        for tip, axis in zip(_texts(toolpath.tips * 1e3, 7), _texts(toolpath.axes, 12), strict=True)
    ]
    lines += _moves(toolpath, rows, comment="; {}", dwell="F", inverse_time=False)
    return ("\n".join([*lines, "TRAFOOF", "M30"]) + "\n").encode()


def _texts(values: Floats, digits: int) -> list[list[str]]:
    return [[plain(value, digits) for value in row] for row in values.tolist()]


def _moves(toolpath: Toolpath, rows: list[list[str]], *, comment: str, dwell: str, inverse_time: bool) -> list[str]:
    """Return the blocks of all waypoints. rows: the words of each; dwell: the letter of a dwell's time."""
    tips, _, kinds, feeds = poses(toolpath)
    dwells = dwell_times(toolpath)
    said = words_before(toolpath)
    lines: list[str] = []
    kind, feed, motion = SegmentKind.CUT, np.nan, ""
    for k, row in enumerate(rows):
        lines += _said(said.get(k, ()), comment)
        move = kinds[k - 1] if k else SegmentKind.RAPID
        if move not in (SegmentKind.RAPID, kind):
            lines.append(comment.format(kind_remark(move)))
            kind = move
        wanted = "G0" if move == SegmentKind.RAPID else "G1"
        words = [wanted, *row] if wanted != motion else list(row)
        motion = wanted
        if move != SegmentKind.RAPID and inverse_time:
            length = float(np.linalg.norm(tips[k] - tips[k - 1]))
            words.append(f"F{plain(feeds[k - 1] / length if length > 0.0 else feeds[k - 1], 9)}")
        elif move != SegmentKind.RAPID and feeds[k - 1] != feed:
            feed = float(feeds[k - 1])
            words.append(f"F{plain(feed, 6)}")
        lines.append(" ".join(words))
        if k in dwells:
            lines.append(f"G4 {dwell}{plain(dwells[k], 9)}")
    return lines + _said(toolpath.end_words, comment)


def _said(words: tuple[str, ...], comment: str) -> list[str]:
    """Return spindle, coolant and tool as blocks; words with an equals sign are comments, but for Sinumerik."""
    return [comment.format(word) if "=" in word and comment.startswith("(") else word for word in words]
