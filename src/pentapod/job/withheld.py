"""Withheld programs: what a run says of a program that fails its own verdict."""

from __future__ import annotations

from pentapod.base.refusal import Refusal
from pentapod.verify import Verdict
from pentapod.verify.verdict.verdict import Certificate

STAGE = "verdict"
"""The stage of the refusal of a program."""


def withheld(verdict: Verdict, *, foreseen: bool = False) -> Refusal | None:
    """Return the refusal of a program some claims about which fail; None where all claims that were judged hold.

    foreseen: the verdict is one on the toolpath, and there is no program.
    """
    failed = list(failures(verdict).values())
    if not failed:
        return None
    rest = len(failed) - 3
    more = f"; and {rest} more claim{'s' if rest > 1 else ''}" if rest > 0 else ""
    return Refusal(
        STAGE,
        f"the program {'would fail' if foreseen else 'fails'} its own verdict: "
        f"{'; '.join(_said(each) for each in failed[:3])}{more}",
        remedy="" if foreseen else "report.html shows where",
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
