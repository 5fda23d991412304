"""Search for advice: estimates rank the changes of a job, and the best ones are planned until enough of them pass."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice

from pentapod.base.errors import InputError
from pentapod.base.progress import Progress
from pentapod.base.refusal import Advice, Change
from pentapod.base.values import Value
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.advice.sketch import Sketch
from pentapod.job.advice.starts import starts
from pentapod.job.advice.trials import FEWEST, Trial, Trials, joined, merged
from pentapod.job.build.toolpath import job_tool
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.toolpath import Toolpath

Passes = Callable[[Job], bool]
"""Plans a job, all stages, and returns whether its verdict passed."""


@dataclass(frozen=True)
class Advised(Value):
    """What a search for advice found. tried: words for what was estimated or planned."""

    advice: tuple[Advice, ...]
    tried: tuple[str, ...]

    @property
    def sentence(self) -> str:
        """What was found, as a sentence without its point."""
        if self.advice:
            return "It can be done with: " + "; or with: ".join(str(each) for each in self.advice)
        if not self.tried:
            return "Nothing was found to try"
        return f"Tried, by estimate or plan: {'; '.join(self.tried)}: none works"


def advised(
    job: Job,
    machine: Machine,
    mesh: Mesh,
    toolpath: Toolpath | None,
    passes: Passes,
    options: AdviceOptions,
    progress: Progress,
) -> Advised:
    """Return changes with which a job that cannot be done is planned, and its verdict passes.

    machine, mesh: the job's. toolpath: None where none could be made.
    """
    found: list[Advice] = []
    tried: dict[str, None] = {}
    trials = _trials(job, machine, mesh, toolpath, options, progress, tried)
    try:
        for trial in islice(trials, options.plans):
            tried[trial.words] = None
            progress("advice", 0.5, f"planning: {trial.words}")
            if _passes(passes, job, trial):
                changes = (Change(table, *item) for table, keys in trial.changes.items() for item in keys.items())
                found.append(Advice(tuple(changes), trial.words, trial.kept, trial.whole))
            if len(found) == options.wanted:
                break
    except KeyboardInterrupt:
        progress("advice", 1.0, "interrupted: what was found is kept")
    return Advised(tuple(found), tuple(tried))


def _passes(passes: Passes, job: Job, trial: Trial) -> bool:
    """Return whether a job passes with the changes of a trial."""
    try:
        return passes(job.with_(**trial.changes))
    except InputError:  # nothing to machine, or values that do not go with each other
        return False


def _trials(
    job: Job,
    machine: Machine,
    mesh: Mesh,
    toolpath: Toolpath | None,
    options: AdviceOptions,
    progress: Progress,
    tried: dict[str, None],
) -> Iterator[Trial]:
    """Yield the trials of the jobs to begin with."""
    for start in starts(job, machine, mesh, options):
        tool = job_tool(start.job, machine)
        if toolpath is None or start.changes:
            sketch = Sketch.of_region(start.job, start.mesh, tool, options.points)
        else:
            sketch = Sketch.of_toolpath(job, mesh, tool, toolpath, options.points)
        if sketch is None or len(sketch.contacts) < FEWEST:
            continue
        trials = Trials(start.job, machine, start.mesh, sketch, options, progress, tried)
        for trial in trials.all(own=bool(start.changes)):
            words, changes = joined(start.words, trial.words), merged(start.changes, trial.changes)
            yield replace(trial, words=words, changes=changes, kept=start.kept * trial.kept)
