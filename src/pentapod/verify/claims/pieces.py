"""Claim that a program does the whole job, or is one of several set-ups that do it together."""

from __future__ import annotations

from pentapod.verify.replay.claim import Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Place


def whole(replay: Replay) -> Finding | Idle:
    """Judge that the job allows several set-ups where this is one, and that each cut is made in exactly one of them."""
    specification, piece = replay.specification, replay.program.provenance.piece
    if piece is None:
        return Idle("the program is the whole job")
    if specification.setups < 2:
        return Finding.without_value(False, f"header: one set-up of several ({piece}); the job allows only one set-up")
    if specification.missed is None:
        why = f"this is one set-up of several ({piece}); only the verdict on the folder of all set-ups knows the others"
        return Idle(why, unknown=True)
    method = "number of intervals between waypoints that are cut in no set-up, or in more than one"
    return Finding(specification.missed == 0, specification.missed, 0.0, "", Place(), method)


WHOLE = "every cut is made in one set-up"
CLAIMS = (Claim(WHOLE, whole, needs_pose=False),)
