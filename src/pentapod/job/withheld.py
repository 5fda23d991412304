"""Withheld programs: what a run says of a program that fails its own verdict, or of a toolpath whose program would."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.refusal import Refusal
from pentapod.job.build.left import missed_by_drops
from pentapod.job.build.region import rolls
from pentapod.job.build.toolpath import Reports
from pentapod.job.schema.job import Job
from pentapod.toolpath.gouge.report import GougeReport
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify import Cutting, Verdict
from pentapod.verify.verdict.verdict import Certificate

STAGE = "verdict"
"""The stage of the refusal of a program."""

FORBIDDEN = "toolpath"
"""The stage of the refusal of a toolpath."""


@dataclass(frozen=True)
class ForesightOptions:
    """When a toolpath is refused since its program would fail its verdict.

    certain: share of the length of cuts that is dropped from which the verdict would find the region missed; missed:
    estimated share of the region that is missed from which it would. As multiples of the share of it that may be left.
    """

    certain: float = 50.0
    missed: float = 2.0


def foreseen(
    job: Job,
    reports: Reports,
    toolpath: Toolpath,
    cutting: Cutting | None,
    options: ForesightOptions = ForesightOptions(),
) -> Refusal | None:
    """Return the refusal of a toolpath that leaves out much of what its ball reaches, as shank or holder would gouge.

    The ball's own places count as reached, so the verdict would find them missed; other cutters may not reach them.
    """
    for report in reports.parts:
        if not isinstance(report, GougeReport) or not rolls(job):
            continue
        most = job.tolerance.left_share
        left = f"{100.0 * most:.2g} % of the region may be left"
        if report.dropped_share > options.certain * most:
            return Refusal(FORBIDDEN, f"{_forbidden(report)}; {left}")
        if not report.dropped or cutting is None or not _is_ball(cutting):
            continue
        missed = missed_by_drops(cutting, toolpath, report.dropped_centres)
        if missed > options.missed * most:
            return Refusal(FORBIDDEN, f"{_forbidden(report)}: about {100.0 * missed:.2g} % of the region; {left}")
    return None


def _forbidden(report: GougeReport) -> str:
    return (
        f"with these tool axes shank or holder would cut into the part on {100.0 * report.dropped_share:.3g} % of the "
        "cuts, which are left out"
    )


def _is_ball(cutting: Cutting) -> bool:
    return bool(cutting.cutter) and cutting.cutter[0].is_ball


def withheld(verdict: Verdict) -> Refusal | None:
    """Return the refusal of a program some claims about which fail; None where all claims that were judged hold."""
    failed = list(failures(verdict).values())
    if not failed:
        return None
    rest = len(failed) - 3
    more = f"; and {rest} more claim{'s' if rest > 1 else ''}" if rest > 0 else ""
    return Refusal(
        STAGE,
        f"the program fails its own verdict: {'; '.join(_said(each) for each in failed[:3])}{more}",
        remedy="report.html shows where",
    )


def failures(verdict: Verdict) -> dict[str, Certificate]:
    """Return the claims that fail, by name."""
    return {certificate.claim: certificate for certificate in verdict.certificates if not certificate.passed}


def _said(certificate: Certificate) -> str:
    """Return a claim that fails, with its value, its bound and the time in the program."""
    text = certificate.claim
    if certificate.value is not None:
        text += f" {certificate.value:.4g} {certificate.unit}".rstrip()
    if certificate.bound is not None:
        text += f" ({certificate.sense} {certificate.bound:.4g})"
    return text + ("" if certificate.where.time_s is None else f" at {certificate.where.time_s:.3f} s")
