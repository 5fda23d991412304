"""Planning pipeline: run the stages of a job in order and write their results.

The part is read and compared with the machine first; what plans it is imported then, which takes longer.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pentapod.base.progress import Progress, silent
from pentapod.job.advice.options import OPTIONS, AdviceOptions, Tried
from pentapod.job.artefacts import check_folder
from pentapod.job.build.reach import check_reach
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.run_folder import staged
from pentapod.job.schema.job import Job
from pentapod.job.stage_runner import StageRunner, ending_when_interrupted
from pentapod.machine.machine import Machine

if TYPE_CHECKING:
    from pentapod.job.outcome import Outcome
    from pentapod.job.pipeline.attempt import Attempt, Writer
    from pentapod.job.plan_before import PlanBefore
    from pentapod.timing import Limit
    from pentapod.toolpath.linking.partition import Piece
    from pentapod.verify import Claim


def run(
    job: Job,
    out: str | Path,
    progress: Progress = silent,
    *,
    machine: Machine | None = None,
    piece: Piece | None = None,
    before: PlanBefore | None = None,
    writers: Mapping[str, Writer] | None = None,
    limits: Sequence[Limit] = (),
    claims: Sequence[Claim] = (),
    advice: AdviceOptions | None = OPTIONS,
) -> Outcome:
    """Plan a job, write program.csv, plan.npz and verdict.json into `out`, and return the outcome.

    machine: to be used instead of the one that the job names, with the job's tool length and controller settings.
    piece: plan only this piece of the job's toolpath, in one set-up. before: the run of the same job with its part
    elsewhere, of which as much is kept as fits. writers: further files, by name, each written from the outcome.
    limits: further limits on the time law. claims: further claims of the verdict. advice: how changes are searched for
    with which a job that cannot be done is planned, and passes; the refusal holds them. None for no search.
    The program is judged from the file, as it was written; if it fails, it is called withheld.csv. A job that cannot be
    done gives an outcome with a refusal, a verdict.json that says so, and no program. The folder changes when the run
    ends: an error or an interruption leaves it as it was. Raises InputError for a bad job, mesh, machine or folder, and
    where another run is writing into the folder.

    >>> outcome = run(Job.load("job.toml"), "out")
    >>> sorted(path.name for path in Path("out").iterdir())
    ['manifest.json', 'plan.npz', 'program.csv', 'verdict.json']
    """
    folder = Path(out)
    check_folder(folder)
    with staged(folder) as staging:  # from the start: a second run on the folder fails at once
        attempt, outcome = _attempted(
            job, staging, progress, machine=machine, piece=piece, before=before, writers=writers,
            limits=tuple(limits), claims=tuple(claims),
        )  # fmt: skip
        if piece is None and advice is not None:
            # Loaded already: slow, and not for a part that cannot fit.
            from pentapod.job.pipeline.stages import with_advice  # noqa: PLC0415

            again = partial(tried, machine=machine, limits=tuple(limits), claims=tuple(claims))
            outcome = with_advice(attempt, outcome, again, advice)
        attempt.write(outcome)
    return outcome


def _attempted(
    job: Job,
    staging: Path,
    progress: Progress,
    *,
    machine: Machine | None = None,
    piece: Piece | None = None,
    before: PlanBefore | None = None,
    writers: Mapping[str, Writer] | None = None,
    limits: tuple[Limit, ...] = (),
    claims: tuple[Claim, ...] = (),
    left_first: bool = False,
) -> tuple[Attempt, Outcome]:
    """Plan a job, write its program into `staging`, and return the attempt and its outcome. Else as `run`.

    left_first: as of `Attempt`.
    """
    if before is not None:
        # Loads what a part that cannot fit does not need.
        from pentapod.job.build.other_ways import as_made  # noqa: PLC0415

        job = as_made(job, before.made_from)
    runner = StageRunner(progress)
    used = job_machine(job, machine)
    mesh = runner.run("mesh", lambda: job_mesh(job, progress), remark=lambda mesh: str(mesh.diagnosis))
    check_reach(job, used, mesh)
    # Slow, and not for a part that cannot fit.
    from pentapod.job.advice.wide_parts import check_wide_part  # noqa: PLC0415
    from pentapod.job.pipeline.stages import planned  # noqa: PLC0415

    if piece is None and before is None:
        check_wide_part(job, used, mesh)
    return planned(
        job, used, mesh, runner, staging, writers or {}, own_machine=machine is not None,
        piece=piece, before=before, limits=limits, claims=claims, left_first=left_first,
    )  # fmt: skip


def tried(job: Job, progress: Progress = silent, **given: Any) -> Tried:
    """Return how the plan of a job ends. Nothing of it is kept.

    given: machine, limits and claims as for `run`, left_first as of `Attempt`.

    Raises InputError as `run`, and KeyboardInterrupt where it would go on with the best that a search found till then.
    """
    with tempfile.TemporaryDirectory() as folder:
        _, outcome = _attempted(job, Path(folder), ending_when_interrupted(progress), **given)
    # Loaded by the run.
    from pentapod.job.pipeline.stages import tried_of  # noqa: PLC0415

    return tried_of(outcome)
