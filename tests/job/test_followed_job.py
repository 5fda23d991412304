"""A job followed through its run goes down from the job's room into those of its stages, and hardly ever back up."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from types import CodeType, FrameType

import pentapod
from pentapod.job import Job, run
from test_floors import PLACES

STAGES = ("mesh", "cutters", "machine", "toolpath", "planning", "timing", "program", "verify")
SOURCE = Path(pentapod.__file__).parent


class Follower:
    """Counts, while a program runs, calls by room of the caller and room of the called function."""

    def __init__(self) -> None:
        self.calls: Counter[tuple[str, str]] = Counter()
        self._rooms: dict[str, str | None] = {}

    def room(self, code: CodeType) -> str | None:
        name = code.co_filename
        if name not in self._rooms:
            path = Path(name)
            inside = path.is_relative_to(SOURCE) and len(path.relative_to(SOURCE).parts) > 1
            self._rooms[name] = path.relative_to(SOURCE).parts[0] if inside else None
        return self._rooms[name]

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        if event != "call" or (here := self.room(frame.f_code)) is None:
            return
        caller = frame.f_back
        while caller is not None and self.room(caller.f_code) is None:
            caller = caller.f_back
        if caller is not None and (there := self.room(caller.f_code)) != here:
            self.calls[there, here] += 1


def test_a_followed_job_climbs_back_up_at_most_four_times(make_job, tmp_path):
    job, follower = Job.load(make_job()), Follower()
    before = sys.getprofile()
    sys.setprofile(follower)
    try:
        outcome = run(job, tmp_path / "out")
    finally:
        sys.setprofile(before)
    assert outcome.passed
    visited = {there for _, there in follower.calls}
    assert visited >= set(STAGES)  # the follower saw all of it
    climbs = {
        f"{caller} calls {called}": count
        for (caller, called), count in follower.calls.items()
        if caller in STAGES and PLACES[called] > PLACES[caller]
    }
    assert sum(climbs.values()) <= 4, climbs
