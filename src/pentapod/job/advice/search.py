"""Search for advice: estimates rank the changes of a job, and the best ones are planned until enough of them pass."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice
from types import MappingProxyType

from pentapod.base.errors import InputError
from pentapod.base.progress import Progress
from pentapod.base.refusal import Advice, Change, Shortfall
from pentapod.base.values import Value
from pentapod.job.advice.failed_claims import FailedClaims, longer, staying
from pentapod.job.advice.options import FEWEST, AdviceOptions, Tried
from pentapod.job.advice.settings import LEFT_ALONE, TOUCHES, Settings, Tell, Trial, joined, merged, met_below
from pentapod.job.advice.sketch import Sketch
from pentapod.job.advice.starts import starts
from pentapod.job.advice.trials import Trials
from pentapod.job.build.other_ways import may_stand
from pentapod.job.build.tool import job_tool
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.verdict.verdict import Certificate

ESTIMATES = 0.3
"""Share of the time of a plan, with the estimates before it, that these take; for the progress alone."""

STAGES = {"toolpath": (0.0, 0.3), "placement": (0.3, 0.6), "tool axis": (0.3, 0.6), "leg path": (0.6, 0.65),
          "timing": (0.65, 0.8), "verify": (0.8, 1.0)}  # fmt: skip
"""Where in a plan its stages begin and end, as shares of its time; for the progress alone."""

Planned = Callable[[Job, Progress], Tried]
"""Plans a job, all stages, and returns how that ended.

Raises KeyboardInterrupt where it is interrupted.
"""


@dataclass(frozen=True)
class Advised(Value):
    """What a search for advice found. tried: words for what was estimated or planned. interrupted: by Ctrl-C.

    reasons: what stands in the way of all that was tried, in words.
    """

    advice: tuple[Advice, ...]
    tried: tuple[str, ...]
    interrupted: bool = False
    reasons: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """What was found, as a sentence without its point."""
        if self.advice:
            return "It can be done with: " + "; or with: ".join(str(each) for each in self.advice)
        if self.interrupted:
            return f"The search was interrupted; tried until then: {'; '.join(self.tried) or 'nothing'}"
        if not self.tried:
            return "Nothing was found to try"
        tried = f"Tried, by estimate or plan: {'; '.join(self.tried)}: none works"
        return ". ".join((tried, *(reason[:1].upper() + reason[1:] for reason in self.reasons)))


def advised(
    job: Job,
    machine: Machine,
    mesh: Mesh,
    toolpath: Toolpath | None,
    planned: Planned,
    options: AdviceOptions,
    progress: Progress,
    failed: Mapping[str, Certificate] = MappingProxyType({}),
    short: Sequence[Shortfall] = (),
    otherwise: frozenset[str] = frozenset(),
    left: float | None = None,
    meets: tuple[float, ...] = (),
    *,
    forbidden: bool = False,
    leaves: float | None = None,
) -> Advised:
    """Return changes with which a job that cannot be done is planned, and its verdict passes.

    machine, mesh: the job's. toolpath: None where none could be made. failed: claims about its program that fail;
    short: limits that its placement exceeds; otherwise: claims that fail where it is planned in another way;
    left: percent of the region that one of these ways leaves, where nothing else fails; meets: heights as of
    `met_below` in one of them.
    forbidden: whether shank or holder forbid what its ball reaches. leaves: share of its cuts at the few places where
    its placement exceeds limits; that they are left out is tried besides all else.
    """
    found: list[Advice] = []
    tried: dict[str, None] = {}
    reasons: dict[str, None] = {}
    # A plan that goes back for another way is two.
    count, interrupted = (options.replans if failed or otherwise else options.plans) + (leaves is not None), False
    ended: list[Tried | None] = [None]
    leaving: list[Trial] = []
    shown = _Shown(progress, count)
    progress("advice", 0.0, "changes of the job are tried; Ctrl-C ends the search")

    def tell(words: str) -> None:
        if words:
            tried[words] = None
            shown.estimate(words)

    if frozenset(failed) == LEFT_ALONE:
        otherwise = LEFT_ALONE
    because, last = (lambda words: reasons.update({words: None}), lambda: ended[-1])
    own = partial(
        Trials, because=because, ended=last, placed=toolpath is not None and not short, otherwise=otherwise,
        meets=met_below(job, mesh, toolpath, short, options) or meets,
    )  # fmt: skip
    trials = _trials(job, machine, mesh, toolpath, options, tell, own, partial(Trials, because=because, ended=last))
    at_last: Iterable[Trial] = ()
    if toolpath is not None:
        claims = FailedClaims(job, machine, mesh, toolpath, failed, options, tell, left, leaves)
        touches = any(each.constraint.startswith(TOUCHES) for each in short)
        # Where it may, a run has planned an upright tool by itself.
        upright = touches and not may_stand(job)
        first = claims.upright() if upright else claims.reaching() if forbidden else ()
        trials, at_last = chain(first, claims.all(), trials), claims.at_last()
    try:
        for number, trial in enumerate(chain(islice(trials, count), at_last, _keeping_most(leaving))):
            tried[trial.words] = None
            ended.append(plan := _ended(planned, job, trial, partial(shown.plan, number, trial.words)))
            shown.number = number + 1
            if plan.stage is None:
                changes = (Change(table, *item) for table, keys in trial.changes.items() for item in keys.items())
                found.append(Advice(tuple(changes), trial.words, trial.kept, trial.whole, plan.margin))
            elif plan.left and (share := longer(1e-2 * options.more * plan.left)) <= options.largest:
                leaving.append(_and(trial, staying(share)))
            if len(found) == options.wanted:
                break
    except KeyboardInterrupt:
        interrupted = True
        progress("advice", 1.0, "interrupted: what was found is kept")
    return Advised(tuple(found), tuple(tried), interrupted, tuple(reasons))


def _keeping_most(trials: list[Trial]) -> Iterator[Trial]:
    """Yield the trial that keeps most, once it is asked for; none where the list is empty."""
    yield from sorted(trials, key=lambda trial: -trial.kept)[:1]


def _and(first: Trial, more: Trial) -> Trial:
    """Return a trial with the changes of another one, too."""
    words, changes = joined(first.words, more.words), merged(first.changes, more.changes)
    return replace(first, words=words, changes=changes, kept=first.kept * more.kept)


@dataclass
class _Shown:
    """The progress of a search of at most `count` plans, whose share never falls: the time left is told from it.

    number: of the plan that is estimated or made. estimates: so far, for that plan.
    """

    progress: Progress
    count: int
    number: int = 0
    estimates: int = 0
    reached: float = 0.0

    def estimate(self, words: str) -> None:
        """Report an estimate; how many are made for a plan is not known before."""
        self.estimates += 1
        self._tell(ESTIMATES * (1.0 - 0.85**self.estimates), words)

    def plan(self, number: int, words: str, stage: str, fraction: float, note: str = "") -> None:
        """Report a stage of a plan as a part of the search."""
        self.number, self.estimates = number, 0
        begins, ends = STAGES.get(stage, (0.0, 0.0))
        share = begins + (ends - begins) * fraction
        self._tell(
            ESTIMATES + (1.0 - ESTIMATES) * share,
            f"plan {number + 1} of at most {max(self.count, number + 1)}: {words}: {stage}",
        )

    def _tell(self, share: float, words: str) -> None:
        self.reached = max(self.reached, min((self.number + share) / self.count, 1.0))
        self.progress("advice", self.reached, words)


def _ended(planned: Planned, job: Job, trial: Trial, progress: Progress) -> Tried:
    """Return how the plan of a job with the changes of a trial ends."""
    try:
        return planned(job.with_(**trial.changes), progress)
    except InputError:  # nothing to machine, or values that do not go with each other
        return Tried("input")


def _trials(
    job: Job,
    machine: Machine,
    mesh: Mesh,
    toolpath: Toolpath | None,
    options: AdviceOptions,
    tell: Tell,
    own: Callable[[Settings], Trials],
    other: Callable[[Settings], Trials],
) -> Iterator[Trial]:
    """Yield the trials of the jobs to begin with. own: makes those of the job itself; other: of a changed one."""
    for start in starts(job, machine, mesh, options, has_toolpath=toolpath is not None):
        tell(start.words)
        tool = job_tool(start.job, machine)
        path = start.toolpath if start.changes else start.toolpath or toolpath
        if path is None:
            sketch = Sketch.of_region(start.job, start.mesh, tool, options.points)
        else:
            sketch = Sketch.of_toolpath(start.job, start.mesh, tool, path, options.points)
        if sketch is None or len(sketch.contacts) < FEWEST:
            continue
        settings = Settings(start.job, machine, start.mesh, sketch, path, options, tell)
        for trial in (other if start.changes else own)(settings).all(own=bool(start.changes)):
            words, changes = joined(start.words, trial.words), merged(start.changes, trial.changes)
            yield replace(trial, words=words, changes=changes, kept=start.kept * trial.kept)
