"""Claims about where the program comes from: its machine, its job."""

from __future__ import annotations

from pentapod.verify.claim import Claim, Finding, Idle
from pentapod.verify.replay import Replay
from pentapod.verify.verdict import Place


def machine(replay: Replay) -> Finding:
    """Judge that the program was made for this machine, by name and by digest."""
    made_for, judged = replay.program.provenance, replay.machine
    passed = made_for.machine == judged.name and made_for.machine_digest == judged.digest
    method = (
        f"header: made for {made_for.machine} ({made_for.machine_digest}), judged on {judged.name} ({judged.digest})"
    )
    return Finding(passed, None, None, "", Place(), method)


def job(replay: Replay) -> Finding | Idle:
    """Judge that the program was made from this job, by digest; not asked where no digest is given."""
    if replay.job_digest is None:
        return Idle("no job is given to compare with", unknown=True)
    made_from = replay.program.provenance.job_digest
    method = f"header: made from job {made_from}, judged for job {replay.job_digest}"
    return Finding(made_from == replay.job_digest, None, None, "", Place(), method)


CLAIMS = (
    Claim("machine", machine, needs_pose=False),
    Claim("job", job, needs_pose=False),
)
