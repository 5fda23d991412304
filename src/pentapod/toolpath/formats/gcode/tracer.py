"""From the moves of a program to poses of the tool: rapids, feeds, arcs as chords, and what is left out."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.formats.gcode.arcs import Arc, interpolated
from pentapod.toolpath.formats.gcode.coordinates import LINEAR, Coordinates, Pose
from pentapod.toolpath.formats.gcode.frames import Frame
from pentapod.toolpath.formats.gcode.language.blocks import Word
from pentapod.toolpath.formats.gcode.language.options import OPTIONS
from pentapod.toolpath.formats.gcode.modes import Modes
from pentapod.toolpath.formats.moves import Moves
from pentapod.toolpath.formats.registry import Defaults
from pentapod.toolpath.formats.rotary import LETTERS
from pentapod.toolpath.toolpath import SegmentKind


class TooManyError(ToolpathError):
    """A file of more waypoints than any: reading ends."""


@dataclass
class Tracer:
    """The moves so far, and where the tool is.

    here: the pose, None where it is not known: before the first one, at home, or in moves that were left out. lifts:
    indices of the poses that are reached over the part. tool: the one in the spindle. swivel, programmed: the frame of
    G68.2 or CYCLE800, and within it that of G68 or ROT. jump: the angles at the start of the next move are not known.
    told: lines of what a user should know, by what it is.
    """

    moves: Moves
    at: Coordinates
    modes: Modes
    defaults: Defaults
    kind: SegmentKind = SegmentKind.CUT
    exact: bool = False
    here: Pose | None = None
    jump: bool = False
    lifts: list[int] = field(default_factory=list[int])
    tool: str = ""
    tools: dict[str, int] = field(default_factory=dict[str, int])
    swivel: Frame | None = None
    programmed: Frame | None = None
    told: dict[str, list[int]] = field(default_factory=dict[str, list[int]])

    def tell(self, what: str, line: int) -> None:
        """Remember what a user should know, with its line."""
        self.told.setdefault(what, []).append(line)

    def wrong(self, what: str, line: int, word: str, remedy: str | None = None) -> ToolpathError:
        """Return the error of a word in a line."""
        return self.moves.wrong(what, line, word, remedy=remedy)

    def set_frames(self, swivel: Frame | None, programmed: Frame | None, *, oriented: bool = False) -> None:
        """Turn the frames. oriented: the tool turns with the swivel."""
        before = self.at.place.copy(), self.at.fixed
        self.swivel, self.programmed = swivel, programmed
        frame = programmed if swivel is None else swivel if programmed is None else swivel.then(programmed)
        self.at.set_frame(frame, swivelled=swivel is not None, oriented=oriented)
        if oriented and before != (self.at.place, self.at.fixed):
            self.here = None

    def set_tcp(self, *, on: bool) -> None:
        """Switch tool centre point programming; where a rotary axis is turned, the place is unknown then."""
        if self.at.set_tcp(on=on):
            self.here = None

    def length(self, words: Mapping[str, Word], letter: str, line: int) -> float:
        """Return the length that a word gives, mm, 0 without the word. Raises ToolpathError without a unit."""
        value = words[letter].value if letter in words else 0.0
        if value and self.modes.scale is None:
            remedy = f'{self.modes.dialect.units} before it, or unit = "mm" in [toolpath]'
            raise self.wrong("the unit is missing", line, str(words[letter]), remedy)
        return value * (self.modes.scale or 1.0)

    def home(self, letters: Iterable[str], line: int) -> None:
        """Send axes to a place of the machine: their coordinates are unknown, rotary axes are at 0."""
        for letter in letters:
            if letter in LINEAR:
                self.at.forget(letter)
            else:
                self.at.place[letter] = 0.0
                self.turn_known(letter)
        self.here = None
        self.tell("home", line)

    def turn_known(self, letter: str) -> None:
        """Take the angle of a rotary axis as known: the file gives it."""
        self.jump = self.jump or self.at.fixed is not None
        self.at.fixed = None
        self.at.lost -= {letter}

    def rapid(self, target: Mapping[str, float], line: int, word: str) -> None:
        """Move on rapid; left out where the place is not known, the way to the next one then leads over the part."""
        self.at.place.update(target)
        self.jump = False
        pose = self.at.pose(self.at.place)
        if pose is None:
            self.here = None
            if self.moves.tips and not self.at.unknown:
                self.tell("positioning", line)
            return
        self._arrive(pose, line, word)

    def feed(
        self, target: Mapping[str, float], line: int, word: str, arc: Arc | None = None, *, own_feed: bool = False
    ) -> None:
        """Move on feed. own_feed: the block has an F. Raises ToolpathError where the place is not known."""
        start = self.at.place.copy()
        self.at.place.update(target)
        pose = self.at.pose(self.at.place)
        if pose is None:
            what, remedy = self.at.why_unknown()
            raise self.wrong(f"a move on feed to an unknown place: {what}", line, word, remedy)
        if self.here is None:
            if arc is not None:
                raise self.wrong("an arc from an unknown place", line, word, "give all axes before it")
            self._arrive(pose, line, word)
            return
        poses = self._chords(self.here, pose, start, arc, line, word)
        self.jump = False
        tips = [self.here.tip, *(p.tip for p in poses)]
        length = sum(math.dist(a, b) for a, b in itertools.pairwise(tips))
        speed = self._speed(length, line, own_feed=own_feed)
        for one in poses:
            self._add(one, self.kind, speed, line, word)
        self.here = pose

    def _arrive(self, pose: Pose, line: int, word: str) -> None:
        if self.here is None and self.moves.tips and not self._other_tool():
            self.lifts.append(len(self.moves.tips))
        self._add(pose, SegmentKind.RAPID, math.inf, line, word)
        self.here = None if self._other_tool() else pose

    def _add(self, pose: Pose, kind: SegmentKind, speed: float, line: int, word: str) -> None:
        self.at.use()
        if self._other_tool():
            self.tell("other tool", line)
            return
        if max(map(abs, pose.tip)) > OPTIONS.farthest:
            raise self.wrong("farther from the origin than any machine reaches", line, word)
        if len(self.moves.tips) >= OPTIONS.waypoints:
            raise TooManyError("too many waypoints", file=self.moves.file, line=line)
        if kind is not SegmentKind.RAPID:
            self.tools.setdefault(self.tool, line)
        self.moves.add(pose.tip, pose.axis, kind, speed, line, word)

    def _other_tool(self) -> bool:
        return self.defaults.tool is not None and self.tool != self.defaults.tool

    def _chords(
        self, first: Pose, last: Pose, start: Mapping[str, float], arc: Arc | None, line: int, word: str
    ) -> list[Pose]:
        """Return the poses of a move, without its start."""
        end = self.at.place

        def place(share: float) -> Pose:
            values = interpolated(start, end, share)
            if arc is not None:
                values.update(arc.point(share))
            pose = self.at.pose(values)
            if pose is None:
                raise self.wrong("a move through unknown places", line, word)
            return pose

        if arc is not None and self.at.fixed is not None and math.dist(first.axis, last.axis) > OPTIONS.axis_tolerance:
            what = "an arc on which the tool axis turns to a vector"
            raise self.wrong(what, line, word, "export it as lines, or with rotary axes")
        count = 1 if arc is None else arc.chords(1e3 * self.defaults.chordal)
        if count > OPTIONS.chords:
            raise self.wrong(f"a move of more than {OPTIONS.chords:,} chords", line, word, "give a larger chordal_mm")
        turn = max(abs(end[letter] - start[letter]) for letter in LETTERS)
        turning = turn > 0.0 and not (self.jump or self.exact) and self.at.fixed is None
        if turning:  # Full turns end where they begin: parts of a turn are looked at.
            count = max(count, math.ceil(min(turn / OPTIONS.part_turn, 1e12)))
        if not turning or (count == 1 and self._straight(first, place(0.5), last)):
            return [*(place((k + 1) / count) for k in range(count - 1)), last]
        return self._refined(place, count, line, word)

    def _refined(self, place: Callable[[float], Pose], count: int, line: int, word: str) -> list[Pose]:
        """Return poses so close that straight moves between them stay within the tolerances."""
        while count <= OPTIONS.chords:
            poses = [place(0.5 * k / count) for k in range(2 * count + 1)]
            if all(self._straight(poses[k], poses[k + 1], poses[k + 2]) for k in range(0, 2 * count, 2)):
                return poses[2::2]
            count *= 2
        raise self.wrong(f"a move of more than {OPTIONS.chords:,} chords", line, word)

    def _straight(self, a: Pose, b: Pose, c: Pose) -> bool:
        """Whether b is within the tolerances of the middle between a and c."""
        sag = math.dist(b.tip, [0.5 * (p + q) for p, q in zip(a.tip, c.tip, strict=True)])
        middle = [p + q for p, q in zip(a.axis, c.axis, strict=True)]
        size = math.hypot(*middle)
        if size < 0.1:
            return False
        turn = math.dist(b.axis, [v / size for v in middle])
        return sag <= 1e3 * self.defaults.chordal * (1.0 + 1e-6) and turn <= OPTIONS.axis_tolerance

    def _speed(self, length: float, line: int, *, own_feed: bool) -> float:
        """Return the feed, mm/min, of a move of this length."""
        modes = self.modes
        if modes.inverse:
            if not own_feed or modes.feed is None:
                raise self.wrong("in G93 every move needs its own feed", line, "F")
            if length > 0.0:
                return length * modes.feed
            # A rotation about the tip has no tip speed; it keeps the last feed.
            return next((f for f in reversed(self.moves.feeds) if math.isfinite(f)), modes.feed)
        if modes.feed is None:
            if self.defaults.feed is None:
                raise self.wrong("the feed is missing", line, "F", "give F before it")
            return 6e4 * self.defaults.feed
        if modes.lengths_only:
            remedy = "G700 in its place, for feeds in inch"
            raise self.wrong("with G70 the unit of the feed is that of the machine", line, "F", remedy)
        if modes.per_turn:
            if not modes.speed:
                raise self.wrong("a feed per turn without the spindle's speed", line, "F", "give S before it, or G94")
            return modes.feed * modes.speed * (modes.scale or 1.0)
        return modes.feed * (modes.scale or 1.0)
