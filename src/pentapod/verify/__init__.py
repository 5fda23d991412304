"""Verify: judges the program that was emitted. Reads it, replays it, certifies it; knows no planner."""

from pentapod.verify.judge import CLAIM_NAMES, CLAIMS, judged, verify, write_verdict
from pentapod.verify.replay.claim import Claim
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.coverage import Coverage
from pentapod.verify.verdict.cutting import Cutting
from pentapod.verify.verdict.sources import Sources
from pentapod.verify.verdict.specification import Specification
from pentapod.verify.verdict.verdict import Certificate, NotJudged, Place, Verdict

__all__ = [
    "CLAIMS",
    "CLAIM_NAMES",
    "Certificate",
    "Claim",
    "Coverage",
    "Cutting",
    "NotJudged",
    "Place",
    "Replay",
    "Sources",
    "Specification",
    "Verdict",
    "judged",
    "verify",
    "write_verdict",
]
