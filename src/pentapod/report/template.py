"""Pages from templates, with everything that a browser needs in the one file. They ask for nothing from elsewhere."""

from __future__ import annotations

import base64
import hashlib
from importlib import resources
from pathlib import Path
from typing import Any

from pentapod.base.files import atomic_write
from pentapod.report import words
from pentapod.report.figure import as_script
from pentapod.report.pack import Packed


def write_page(
    path: str | Path, template: str, page: dict[str, Any] | None = None, packed: Packed | None = None, **context: Any
) -> Path:
    """Write `page_text` to a file and return its path. Raises InputError: it cannot be written."""
    text = page_text(template, page, packed, **context)
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def page_text(
    template: str,
    page: dict[str, Any] | None = None,
    packed: Packed | None = None,
    *,
    live: bool = False,
    **context: Any,
) -> str:
    """Return the page of a template of this folder.

    page, packed: what the page's script draws (`web/main.js`), and the arrays for it; None for a page without a script.
    live: the page may ask the server that it comes from, and that one alone (`web/live.js`).
    """
    import jinja2  # noqa: PLC0415 - heavy, and only needed here

    folder = resources.files("pentapod.report")
    styles = ["style.css", *([] if page is None else ["figures.css"]), *(["live.css"] if live else [])]
    files = {name: (folder / name).read_text(encoding="utf-8") for name in (template, *styles)}
    script = "" if page is None else (folder / "web" / "page.min.js").read_text(encoding="utf-8")
    arrays = Packed() if packed is None else packed
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters.update(number=words.number, duration=words.duration, opening=words.opening)
    return environment.from_string(files[template]).render(
        style="".join(files[name] for name in styles),
        script=script,
        policy=_policy(script, live=live),
        page=as_script({**(page or {}), "arrays": arrays.directory}),
        arrays=arrays.block,
        live=live,
        **context,
    )


def _policy(script: str, *, live: bool) -> str:
    """Return the Content-Security-Policy: no script but this one, and no request, but to the own server if live."""
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    own = "; connect-src 'self'; frame-src 'self'" if live else ""
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; base-uri 'none'; "
        f"form-action 'none'{own}"
    )
