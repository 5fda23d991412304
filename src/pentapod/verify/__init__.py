"""Verify: judges the program that was emitted. Reads it, replays it, certifies it; knows no planner."""

from pentapod.verify.claim import Claim
from pentapod.verify.coverage import Coverage
from pentapod.verify.cutting import Cutting
from pentapod.verify.judge import CLAIM_NAMES, CLAIMS, judged, verify, write_verdict
from pentapod.verify.replay import Replay
from pentapod.verify.sources import Sources
from pentapod.verify.specification import Specification
from pentapod.verify.verdict import Certificate, NotJudged, Place, Verdict

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
