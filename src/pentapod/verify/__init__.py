"""Verify: judges the program that was emitted. Reads it, replays it, certifies it; knows no planner."""

from pentapod.verify.claim import Claim
from pentapod.verify.cutting import Cutting
from pentapod.verify.judge import CLAIMS, verify, write_verdict
from pentapod.verify.replay import Replay
from pentapod.verify.verdict import Certificate, Place, Verdict

__all__ = ["CLAIMS", "Certificate", "Claim", "Cutting", "Place", "Replay", "Verdict", "verify", "write_verdict"]
