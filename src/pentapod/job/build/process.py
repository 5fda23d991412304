"""Process data of a job: the words that its toolpath says of spindle, coolant, tool and laser."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from pentapod.job.schema.job import Job
from pentapod.toolpath.process import Process, laser_word, plain_word, subject
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

COOLANTS = {"off": (), "mist": ("M7",), "flood": ("M8",), "both": ("M7", "M8")}


def with_process(job: Job, toolpath: Toolpath) -> Toolpath:
    """Return a toolpath that says what [process] asks for, instead of what it has said about the same so far."""
    keys = job.process
    given = {
        "tool": keys.tool_number,
        "spindle": keys.spindle_rpm,
        "coolant": keys.coolant,
        "laser": keys.laser_power,
    }
    own = {name for name, value in given.items() if value is not None}
    if not own:
        return toolpath

    def kept(words: Iterable[str]) -> tuple[str, ...]:
        return tuple(word for word in words if subject(word) not in own)

    begin, end = list[str](), list[str]()
    if "tool" in own:
        begin += [f"T{keys.tool_number}", "M6"]
    if keys.spindle_rpm:
        said = [plain_word(word) for segment in toolpath.segments for word in segment.words]
        turn = next((word for word in said if word in ("M3", "M4")), "M3")
        begin += [f"S{keys.spindle_rpm:.10g}", turn]
        end.append("M5")
    if "coolant" in own and (words := COOLANTS[keys.coolant]):
        begin += words
        end.insert(0, "M9")
    powers = [
        ()
        if keys.laser_power is None
        else (laser_word(keys.laser_power * each.power * (each.kind is SegmentKind.CUT)),)
        for each in toolpath.segments
    ]
    changed = [power if k == 0 or power != powers[k - 1] else () for k, power in enumerate(powers)]
    made = [
        replace(each, words=(*(() if k else begin), *kept(each.words), *power))
        for k, (each, power) in enumerate(zip(toolpath.segments, changed, strict=True))
    ]
    end += () if keys.laser_power is None else (laser_word(0.0),)
    return replace(toolpath, segments=tuple(made), end_words=(*kept(toolpath.end_words), *end))


def continued(whole: Toolpath, part: Toolpath, first: int) -> Toolpath:
    """Return a part of a toolpath that begins with what the whole has said up to its interval `first`."""
    before = whole.segments[: int(whole.segment_of_interval[first])]
    words = Process().after(word for segment in before for word in segment.words).words
    if not words:
        return part
    begin, *others = part.segments
    return replace(part, segments=(replace(begin, words=words), *others))
