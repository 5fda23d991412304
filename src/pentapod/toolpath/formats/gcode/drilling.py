"""Drilling cycles: G73, G81, G82, G83, G85, G86, G89, and Sinumerik's CYCLE81, CYCLE82, CYCLE83."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from pentapod.base.files import number_in
from pentapod.toolpath.formats.gcode.arcs import PLANES
from pentapod.toolpath.formats.gcode.language.blocks import Word
from pentapod.toolpath.formats.gcode.language.options import OPTIONS
from pentapod.toolpath.formats.gcode.tracer import Tracer

_CHIP_BREAKING, _PECKING = 73.0, 83.0
_SLOW_OUT, _DWELLING = frozenset({85.0, 89.0}), frozenset({82.0, 89.0})


class Step(NamedTuple):
    """A move along the drilling axis to a height, mm, or a dwell, s, where there is no height."""

    height: float | None
    rapid: bool = True
    dwell: float = 0.0


@dataclass(frozen=True)
class Drilling:
    """A drilling cycle at one hole. Heights along the drilling axis, mm.

    code: of the cycle. top: where the feed begins (R). bottom: of the hole. out: where it ends. peck: depth of a peck,
    0 for none. dwell: seconds at the bottom, None for no stop.
    """

    code: float
    top: float
    bottom: float
    out: float
    peck: float = 0.0
    dwell: float | None = None

    @property
    def pecks(self) -> float:
        """The number of pecks."""
        return abs(self.top - self.bottom) / self.peck if self.peck > 0.0 else 1.0

    def steps(self) -> Iterator[Step]:
        """Yield the moves, from above the hole."""
        yield Step(self.top)
        down = 1.0 if self.bottom < self.top else -1.0
        if self.code in (_CHIP_BREAKING, _PECKING) and self.peck > 0.0:
            depth = self.top - down * self.peck
            while down * (depth - self.bottom) > 0.0:
                yield Step(depth, rapid=False)
                back = min(OPTIONS.peck, self.peck)
                if self.code == _PECKING:
                    yield Step(self.top)
                yield Step(depth + down * back)
                depth -= down * self.peck
        yield Step(self.bottom, rapid=False)
        if self.dwell is not None:
            yield Step(None, dwell=self.dwell)
        if self.code in _SLOW_OUT:
            yield Step(self.top, rapid=False)
        yield Step(self.out)


_PARAMETERS = ("RTP", "RFP", "SDIS", "DP", "DPR")
_CALLED: dict[str, tuple[float, tuple[str, ...]]] = {
    "CYCLE81": (81.0, ()),
    "CYCLE82": (82.0, ("DTB",)),
    "CYCLE83": (_PECKING, ("FDEP", "FDPR", "DAM", "DTB", "DTS", "FRF", "VARI")),
}
"""The G code that is like each of Sinumerik's cycles, and its parameters after the common ones."""


@dataclass
class Drill:
    """The drilling cycle that is on. held: words of the cycle that hold on, mm; start: height where it was begun.

    modal: the cycle that MCALL runs at each place.
    """

    tracer: Tracer
    held: dict[str, float] = field(default_factory=dict[str, float])
    start: float | None = None
    modal: Drilling | None = None

    names = frozenset(_CALLED)

    def at(self, target: dict[str, float], words: Mapping[str, Word], line: int) -> None:
        """Drill at the places of a block of G73 to G89."""
        modes, place = self.tracer.modes, self.tracer.at.place
        code, normal = modes.cycle or 0.0, PLANES[modes.plane][2]
        word = f"G{code:g}"
        if self.start is None:
            self.start = place.get(normal)
        if self.start is None:
            raise self.tracer.wrong(
                f"{normal} is not known where the cycle begins", line, word, f"give {normal} before it"
            )
        scale = modes.scale or 1.0
        for letter in ("R", "Q"):
            if letter in words:
                base = self.start if letter == "R" and not modes.absolute else 0.0
                self.held[letter] = base + words[letter].value * scale
        if normal in words:
            base = 0.0 if modes.absolute else self.held.get("R", 0.0)
            self.held[normal] = base + words[normal].value * scale
        if "P" in words:
            self.held["P"] = words["P"].value * (1e-3 if modes.dialect.milliseconds else 1.0)
        if "R" not in self.held or normal not in self.held:
            raise self.tracer.wrong("a cycle without its depth or its R", line, word, f"{word} X… Y… {normal}… R…")
        top, bottom = self.held["R"], self.held[normal]
        out = max(self.start, top) if modes.to_start else top
        dwell = self.held.get("P", 0.0) if code in _DWELLING else None
        one = Drilling(code, top, bottom, out, abs(self.held.get("Q", 0.0)), dwell)
        count = int(next((words[k].value for k in ("K", "L") if k in words), 1.0))
        if count * one.pecks > OPTIONS.chords:
            raise self.tracer.wrong("a cycle of too many holes or pecks", line, word)
        step = {k: v - place[k] for k, v in target.items() if k in place} if not modes.absolute else {}
        for repeat in range(count):
            flat = {k: v for k, v in target.items() if k != normal}
            flat = {k: v + repeat * step.get(k, 0.0) for k, v in flat.items()}
            if place.get(normal, one.out) < top and bottom < top:
                self.tracer.rapid({normal: top}, line, word)
            self.tracer.rapid(flat, line, word)
            self._run(one, normal, line, word)

    def end(self) -> None:
        """No cycle holds on."""
        self.held, self.start = {}, None

    def called(self, name: str, arguments: Sequence[str], line: int, *, modal: bool) -> None:
        """CYCLE81 to CYCLE83 of Sinumerik: here, or at each following place after MCALL; MCALL alone ends that."""
        if name == "MCALL":
            self.modal = None
            return
        names = (*_PARAMETERS, *_CALLED[name][1])
        given = {key: v for key, text in zip(names, arguments, strict=False) if (v := number_in(text)) is not None}
        scale = self.tracer.modes.scale or 1.0
        length = {key: v * scale for key, v in given.items()}
        if "RFP" not in given or not {"DP", "DPR"} & set(given):
            raise self.tracer.wrong("a cycle without its depth", line, name, f"{name}(RTP, RFP, SDIS, DP)")
        reference = length["RFP"]
        top = reference + length.get("SDIS", 0.0)
        bottom = length["DP"] if "DP" in given else reference - abs(length["DPR"])
        peck = abs(reference - length["FDEP"]) if "FDEP" in given else abs(length.get("FDPR", 0.0))
        code = _CALLED[name][0]
        if code == _PECKING and not given.get("VARI"):
            code = _CHIP_BREAKING
        dwell = given.get("DTB")
        if dwell is not None and dwell < 0.0:
            raise self.tracer.wrong("a dwell in turns of the spindle", line, name, "export it in seconds")
        one = Drilling(code, top, bottom, max(length.get("RTP", top), top), peck, dwell)
        if one.pecks > OPTIONS.chords:
            raise self.tracer.wrong("a cycle of too many holes or pecks", line, name)
        if modal:
            self.modal = one
        else:
            self._run(one, PLANES[self.tracer.modes.plane][2], line, name)

    def run_modal(self, line: int) -> None:
        """Drill at a place after MCALL."""
        if self.modal is not None:
            self._run(self.modal, PLANES[self.tracer.modes.plane][2], line, "MCALL")

    def _run(self, one: Drilling, normal: str, line: int, word: str) -> None:
        for step in one.steps():
            if step.height is None:
                self.tracer.moves.add_dwell(step.dwell)
            elif step.rapid:
                self.tracer.rapid({normal: step.height}, line, word)
            else:
                self.tracer.feed({normal: step.height}, line, word)
