"""Claim that a program is the whole work, or one of several that together are."""

from __future__ import annotations

from pentapod.verify.replay.claim import Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Place


def whole(replay: Replay) -> Finding | Idle:
    """Judge that a program of one of several set-ups may be such, and that all of them make each cut once."""
    asked, piece = replay.specification, replay.program.provenance.piece
    if piece is None:
        return Idle("the program is the whole job")
    if asked.setups < 2:
        method = f"header: only a piece of the job ({piece}); the job is to be done in one set-up"
        return Finding(False, None, None, "", Place(), method)
    if asked.missed is None:
        why = f"this is one set-up ({piece}); what the others cut is known to the verdict on the folder of all set-ups"
        return Idle(why, unknown=True)
    method = "intervals between waypoints that should be cut and are cut in no set-up, or in more than one"
    return Finding(asked.missed == 0, asked.missed, 0.0, "", Place(), method)


WHOLE = "every cut is made in one set-up"
CLAIMS = (Claim(WHOLE, whole, needs_pose=False),)
