"""Pages from templates, with everything that a browser needs in the one file."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any

from pentapod.base.files import atomic_write
from pentapod.report import words
from pentapod.report.figure import PLOT_CONFIG, as_script


def write_page(path: str | Path, template: str, **context: Any) -> Path:
    """Write the page of a template of this folder and return its path. Raises InputError: it cannot be written."""
    import jinja2  # noqa: PLC0415 - heavy, and only needed here

    folder = resources.files("pentapod.report")
    files = {name: (folder / name).read_text(encoding="utf-8") for name in (template, "style.css", "page.js")}
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters.update(number=words.number, duration=words.duration, opening=words.opening)
    text = environment.from_string(files[template]).render(
        style=files["style.css"],
        script=files["page.js"],
        plotly=_plotly() if "{{ plotly" in files[template] else "",
        plot_config=as_script(PLOT_CONFIG),
        **context,
    )
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def _plotly() -> str:
    """Return the JavaScript of figures, which a page without any does not need."""
    import plotly.offline  # noqa: PLC0415

    return plotly.offline.get_plotlyjs()
