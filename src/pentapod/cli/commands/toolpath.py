"""pentapod toolpath: write a job's toolpath alone, in the workpiece frame."""

from __future__ import annotations

from pathlib import Path

import click

from pentapod.cli.output import echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar


@click.command()
@click.argument("job", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), help="File to write; its suffix names the format.")
@click.option("--format", "format_name", help="Format, where the suffix does not name it: see above.")
@json_option
@quiet_option
def toolpath(job: Path, out: Path | None, format_name: str | None, as_json: bool, quiet: bool) -> int:
    """Make the toolpath of JOB.toml, without placement and time law; print its figures, and write it where -o says.

    Formats: apt (.apt .cls .cl .cldata), xyzab G-code of LinuxCNC's pentakins (.ngc), xyzbc G-code with G43.4 (.nc
    .tap), both also as xyzab-g93 and xyzbc-g93 with inverse time feed, sinumerik (.mpf), robodk (.robodk.csv), csv,
    npz. Axes point from the tip to the spindle; the frame is that of the workpiece.
    """
    from pentapod.base.errors import JobError
    from pentapod.geometry import arc_length
    from pentapod.job.build.reach import check_reach
    from pentapod.job.build.toolpath import job_toolpath
    from pentapod.job.build.values import job_machine, job_mesh
    from pentapod.job.schema.job import Job
    from pentapod.toolpath.formats import format_of, write_toolpath

    if out is not None:
        format_of(out, format_name)  # an unknown format fails at once
    loaded = Job.load(job)
    with progress_bar(quiet=quiet or as_json) as progress:
        progress("mesh", 0.0)
        mesh = job_mesh(loaded, progress)
        progress("mesh", 1.0)
        machine = job_machine(loaded)
        try:
            check_reach(loaded, machine, mesh)
        except JobError as error:  # a part that is too large may be for another machine; a wrong unit takes a long time
            if error.key == "part.unit":
                raise
        progress("toolpath", 0.0)
        path, report = job_toolpath(loaded, mesh, progress, machine=machine)
        progress("toolpath", 1.0)
        if out is not None:
            progress("writing", 0.0, out.name)
            write_toolpath(path, out, format_name)
    kinds = [str(segment.kind) for segment in path.segments]
    lengths = [1e3 * float(arc_length(segment.tips)[-1]) for segment in path.segments]
    by_kind = {kind: sum(v for k, v in zip(kinds, lengths, strict=True) if k == kind) for kind in set(kinds)}
    if as_json:
        summary = {"waypoints": len(path), "segments": len(kinds), "length_mm": dict(sorted(by_kind.items()))}
        echo_json({**summary, **({} if out is None else {"file": str(out)})})
    elif not quiet:
        click.echo(str(mesh.diagnosis))
        click.echo(str(report))
        if out is not None:
            click.echo(f"wrote {out}")
    return 0
