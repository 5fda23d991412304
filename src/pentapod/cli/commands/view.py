"""pentapod view: a run in the browser, live."""

# ruff: noqa: PLC0415 - a verb loads what it needs when it runs, so that --help stays quick

from __future__ import annotations

import threading
import webbrowser
from pathlib import Path

import click

from pentapod.cli.numbers import Whole
from pentapod.cli.output import echo_json, json_option, progress_bar, quiet_option


@click.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option("--job", type=click.Path(path_type=Path), help="The job it was made from, where that was moved.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on; 0.0.0.0 for all.")
@click.option("--port", type=Whole(1, 65535), default=8080, show_default=True,
              help="Port to listen on; the next one where it is taken.")  # fmt: skip
@click.option("--open/--no-open", "opens", default=True, help="Open a browser there.")
@json_option
@quiet_option
def view(folder: Path, job: Path | None, host: str, port: int, opens: bool, as_json: bool, quiet: bool) -> int:
    """Look at the run in DIR: machine, part and path, live in a browser, until Ctrl-C.

    Scrub and play the program; drag the part and see at once what its new place comes to, green to red along the
    path; plan anew with the part there (into DIR/replanned). Needs the extra "view". --json prints the address. The
    token in the address lets your browser in; web pages of others that are open in it are refused.
    """
    from pentapod.view import Viewer, open_run
    from pentapod.view.doors import load_viser

    load_viser()  # fails at once where it is not installed
    with progress_bar(quiet=quiet or as_json) as progress:
        run = open_run(folder, job, progress)
    with Viewer(run, host=host, port=port) as viewer:
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
