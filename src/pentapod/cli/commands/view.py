"""pentapod view: show a run in the browser, live."""

from __future__ import annotations

import threading
import webbrowser
from pathlib import Path

import click

from pentapod.cli.numbers import Whole
from pentapod.cli.output import echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.argument("other", type=click.Path(path_type=Path), metavar="[DIR2]", required=False)
@click.option("--job", type=click.Path(path_type=Path), help="The job file of the run, if it was moved.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on; 0.0.0.0 for all.")
@click.option("--port", type=Whole(1, 65535), default=8080, show_default=True,
              help="Port to listen on; the next free one if it is in use.")  # fmt: skip
@click.option("--open/--no-open", "opens", default=True, help="Open a browser.")
@json_option
@quiet_option
def view(
    folder: Path, other: Path | None, job: Path | None, host: str, port: int, opens: bool, as_json: bool, quiet: bool
) -> int:
    """Show the run in DIR live in a browser: machine, part and path. Ctrl-C ends.

    Play the program; drag the part, or type where it is, and see the margins there along the path; plan again with the
    part there (into DIR/replanned). With DIR2, two runs are shown side by side. --json prints the address. Only
    requests with the token in the address are answered.
    """
    from pentapod.view import Viewer, open_run

    with progress_bar(quiet=quiet or as_json) as progress:
        run = open_run(folder, job, progress)
        second = None if other is None else open_run(other, None, progress)
        progress("page", 0.0)
        viewer = Viewer(run, second, host=host, port=port)
    with viewer:
        try:
            if as_json:
                echo_json({"url": viewer.url})
            elif not quiet:
                click.echo(f"{viewer.url} (Ctrl-C ends)")
            if opens:
                webbrowser.open(viewer.url)
            threading.Event().wait()
        except KeyboardInterrupt:
            return 0
    return 0
