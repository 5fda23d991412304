"""Other ways to do a job that fails as it is asked for: an upright tool, or passes nearer together.

An upright tool stands along the view everywhere, and passes end where the part leans over them: for parts on which no
smooth lean keeps a ball clear, and for concave ones, where bull and flat ends cannot stand along the normals. What such
a tool does not reach is left: the verdict tells how much of it a leaning tool might reach.

On slopes bull and flat ends leave stairs between passes that are higher than the ridges of a plane, by which the bound
of what may be left is chosen: passes nearer together keep that bound. A ball may leave a little too much where passes
end under what leans over them.
"""

from __future__ import annotations

from dataclasses import replace

from pentapod.base.units import from_si
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.registry import CUTTERS
from pentapod.job.build.region import covers_region, rolls
from pentapod.job.build.tool import job_tool
from pentapod.job.build.toolpath import job_options
from pentapod.job.schema.job import Job
from pentapod.program.program import Provenance
from pentapod.toolpath.strategies.registry import STRATEGIES
from pentapod.verify import Coverage
from pentapod.verify.verdict.verdict import Certificate

NEARER = (0.5, 0.3)
"""Distances between passes, as shares of what is asked for, that are tried where passes come nearer together."""

LITTLE = 10.0
"""A ball's passes come nearer only if no more than this multiple of what may be left is left: more has other causes."""

ROUNDING = 1.0 - 1e-9
"""Shares that differ by less count as equal."""

ATTEMPTS = ("first", "second", "third", "fourth")
"""How the plans of a run are counted in words."""

STANDS = (
    "second attempt: the tool stays upright, and passes end where the part leans over them, because no lean was found "
    "that keeps the tool clear of the part"
)
"""What is said of a job that an upright ball does."""

STANDS_ON_END = (
    "second attempt: the tool keeps one direction, that of the region, because the job cannot be done with its axes "
    "along the normals of the surface"
)
"""What is said of a job that an upright bull or flat end does."""


def as_made(job: Job, made_from: Provenance) -> Job:
    """Return the job as a program does it: in another way, where its header says so and the job lets it."""
    if made_from.upright and may_stand(job):
        job = standing(job)
    if made_from.stepover_share < 1.0 and nearer_share(job) is not None:
        job = nearer(job, made_from.stepover_share)
    return job


def may_stand(job: Job) -> bool:
    """Return whether an upright tool may do a job: it covers a region, and its axis is left to the planner."""
    if job.axis.mode != "auto" or not covers_region(job):
        return False
    return rolls(job) or (ends(job) and STRATEGIES[job.toolpath.strategy].options.rolls)


def standing(job: Job) -> Job:
    """Return the job with the tool along its view, and no passes under what leans over. Its digest stays."""
    axis = dict.fromkeys(job.axis.model_fields_set)
    axis |= {"mode": "fixed", "direction": job.part.region_direction, "tilt_deg": 0.0}
    made = job.with_(axis=axis, **({} if ends(job) else {"toolpath": {"under_mm": 0.0}}))
    return replace(made, asked=job.asked or job, from_file=job.from_file)


def made_upright(job: Job) -> tuple[Job, str]:
    """Return the job that an upright tool does, and what is said of it."""
    return standing(job), STANDS_ON_END if ends(job) else STANDS


def stands(job: Job) -> bool:
    """Return whether a job is one that an upright tool does, though it was asked for with a tool that leans."""
    return job.asked is not None and job.axis.mode != job.asked.axis.mode


def nearer_share(job: Job) -> float | None:
    """Return the next share of the asked distance between passes that may do a job; None where none is left.

    Only where the tool covers a region.
    """
    if not covers_region(job):
        return None
    return next((share for share in NEARER if share < ROUNDING * stepover_share(job)), None)


def may_come_nearer(job: Job, left: Certificate) -> bool:
    """Return whether passes nearer together may do a job whose only failing claim is about what is left."""
    return nearer_share(job) is not None and (ends(job) or (left.value or 0.0) <= LITTLE * (left.bound or 0.0))


def ends(job: Job) -> bool:
    """Return whether a job's tool is a bull or flat end."""
    return issubclass(CUTTERS[job.tool.type], BullNose)


def nearer(job: Job, share: float) -> Job:
    """Return the job with passes nearer together, and the same bound of what may be left. Its digest stays.

    share: of the asked distance between passes.
    """
    asked = job.asked or job
    table = asked.toolpath.model_dump(include={"stepover_mm", "scallop_mm"}, exclude_none=True)
    # The height of a ridge grows with the square of the distance between passes.
    closer = {key: value * (share if key == "stepover_mm" else share**2) for key, value in table.items()}
    left = job.tolerance.left_mm or from_si(_allowed_left(job), "mm")
    made = job.with_(toolpath=closer, tolerance={"left_mm": left})
    return replace(made, asked=asked, from_file=job.from_file)


def nearer_words(job: Job) -> str:
    """Return what is said of a job that passes nearer together do."""
    share, left = stepover_share(job), f"{job.tolerance.left_mm:.3g} mm"
    before = stands(job) + sum(ROUNDING * each > share for each in NEARER)
    passes = f"passes are {share:.2g} times as far apart as asked"
    return f"{ATTEMPTS[1 + before]} attempt: {passes}, because more than {left} would be left between them"


def stepover_share(job: Job) -> float:
    """Return the distance between a job's passes as a share of what was asked for; 1 where it was not changed."""
    if job.asked is None:
        return 1.0
    ours, asked = job.toolpath, job.asked.toolpath
    distance, height = getattr(asked, "stepover_mm", None), getattr(asked, "scallop_mm", None)
    if distance is not None:
        return float(getattr(ours, "stepover_mm", distance)) / distance
    return 1.0 if height is None else float((getattr(ours, "scallop_mm", height) / height) ** 0.5)


def _allowed_left(job: Job) -> float:
    """Return the height of what a job may leave, metres."""
    return Coverage.allowed_left(job_options(job), job_tool(job), job.tolerance.si.path)
