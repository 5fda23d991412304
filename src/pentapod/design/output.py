"""The files of a search: the front as tables and as a page, and each member's machine file."""

from __future__ import annotations

import csv
import io
import json
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.files import atomic_write
from pentapod.base.version import __version__
from pentapod.design.members import MACHINE, Front, Member
from pentapod.design.quantities import QUANTITIES, Quantity
from pentapod.job.artefacts import REPORT
from pentapod.report.drawings.colours import LIMIT_COLOUR, QUIET_COLOUR
from pentapod.report.drawings.views import machine_drawings
from pentapod.report.template import write_page
from pentapod.report.words import number

TABLE, CONTENT, PAGE = "front.csv", "front.json", "design.html"
WIDE, HIGH, RIM = 520.0, 300.0, 60.0
"""Of the drawing of the front, with the rim for its axes."""


def folder_of(number: int) -> str:
    """Return the folder of a member, by its number from 1."""
    return f"member-{number:02d}"


def write_front(front: Front, folder: Path) -> Path:
    """Write the files of a front into a folder that exists, and return the page. Raises InputError: not writable."""
    for number_, member in enumerate(front.members, start=1):
        place = folder / folder_of(number_)
        place.mkdir(exist_ok=True)
        _write(place / MACHINE, member.machine)
    _write(folder / TABLE, _table(front))
    _write(folder / CONTENT, json.dumps(to_dict(front), indent=2) + "\n")
    return _page(front, folder / PAGE)


def to_dict(front: Front) -> dict[str, Any]:
    """Return the content of front.json: each design with its quantities, proven and sampled, and by which means."""
    file = front.file
    known = _known(front)
    return {
        "pentapod": __version__,
        "file": file.path.name,
        "designs": front.designs,
        "poses": front.poses,
        "objectives": {QUANTITIES[name].key: "minimise" if s > 0 else "maximise" for name, s in file.objectives},
        "needs": [
            {"quantity": QUANTITIES[n.quantity].key, "must_be": "at most" if n.sense > 0 else "at least",
             "bound": QUANTITIES[n.quantity].shown(n.bound)}
            for n in file.needs
        ],
        "means": {q.key: q.means for q in known},
        "members": [
            {"machine": f"{folder_of(k)}/{MACHINE}", **_member(m, known)} for k, m in enumerate(front.members, 1)
        ],
        "dropped": [{**_member(m, known), "why": list(m.missing)} for m in front.dropped],
    }  # fmt: skip


def _member(member: Member, known: list[Quantity]) -> dict[str, Any]:
    return {
        "proven": {q.key: q.shown(member.proven[q.name]) for q in known},
        "worst_known": {q.key: q.shown(member.dense[q.name]) for q in known},
        "boxes": member.boxes,
        "parts": [
            {"job": part.job, "passed": part.passed, "verdict": part.said, "folder": part.folder}
            for part in member.parts
        ],
    }


def _known(front: Front) -> list[Quantity]:
    """Return the quantities that the designs have."""
    every = (*front.members, *front.dropped)
    return [q for q in QUANTITIES.values() if every and all(q.name in m.proven for m in every)]


def _table(front: Front) -> str:
    text, known = io.StringIO(), _known(front)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["machine", *(q.key for q in known), *(f"{q.key} (worst known)" for q in known)])
    for k, member in enumerate(front.members, 1):
        values = [q.shown(of[q.name]) for of in (member.proven, member.dense) for q in known]
        writer.writerow([f"{folder_of(k)}/{MACHINE}", *(f"{value:.8g}" for value in values)])
    return text.getvalue()


def _page(front: Front, path: Path) -> Path:
    file, kept = front.file, len(front.members)
    lead = (
        f"After {front.designs:,} evaluations the best {kept + len(front.dropped)} designs went to the proofs, and "
        f"{kept} are on the front: they keep every need in the whole work volume, and none is better in everything."
    )
    facts = [
        ("start", file.machine.name),
        ("search", f"{file.search.generations} generations of {file.search.population}, seed {file.search.seed}"),
        ("poses of the sample", str(front.poses)),
        ("parts", ", ".join(job.path.name for job in file.jobs) or "none"),
    ]
    gap = 100.0 * max((_gap(member) for member in front.members), default=0.0)
    known = f"The worst poses that are known come within {gap:.2g} % of the bounds of the force amplification."
    members = [_shown(front, number_, member) for number_, member in enumerate(front.members, start=1)]
    dropped = [(headline(front, member), "; ".join(member.missing)) for member in front.dropped]
    return write_page(
        path, "design.html.j2", title=file.path.stem, lead=lead, facts=facts, members=members, rows=_rows(front),
        plot=_plot(front), sampled=known, dropped=dropped,
    )  # fmt: skip


def _rows(front: Front) -> list[dict[str, Any]]:
    """Return the rows of the page's table of quantities."""
    file = front.file
    bounds = {
        need.quantity: f"{'≤' if need.sense > 0 else '≥'} {number(QUANTITIES[need.quantity].shown(need.bound))}"
        for need in file.needs
    }
    senses = {name: "small" if sense > 0 else "large" for name, sense in file.objectives}
    return [
        {
            "key": q.key,
            "asked": bounds.get(q.name, ""),
            "objective": senses.get(q.name),
            "means": q.means,
            "proven": [number(q.shown(member.proven[q.name])) for member in front.members],
        }
        for q in _known(front)
    ]


def _shown(front: Front, number_: int, member: Member) -> dict[str, Any]:
    """Return what the page shows of a member."""
    return {
        "number": number_,
        "folder": folder_of(number_),
        "headline": headline(front, member),
        "proof": f"proven by {member.boxes:,} boxes of poses",
        "views": machine_drawings(member.loaded()),
        "parts": [(f"{part.job}: {part.said}", f"{part.folder}/{REPORT}") for part in member.parts],
    }


def _gap(member: Member) -> float:
    return member.proven["amplification"] / member.dense["amplification"] - 1.0


def headline(front: Front, member: Member) -> str:
    """Return a member's objectives as text."""
    asked = [QUANTITIES[name] for name, _ in front.file.objectives]
    return ", ".join(f"{q.key} {number(q.shown(member.proven[q.name]))}" for q in asked)


def _plot(front: Front) -> str:
    """Return the first two objectives of all proven designs as an SVG element; empty where there is one objective."""
    every = (*front.members, *front.dropped)
    if len(front.file.objectives) < 2 or not every:
        return ""
    pair = [QUANTITIES[name] for name, _ in front.file.objectives[:2]]
    values = np.array([[q.shown(member.proven[q.name]) for q in pair] for member in every])
    low, high = values.min(axis=0), values.max(axis=0)
    share = (values - low) / np.where(high > low, high - low, 1.0)
    x, y = RIM + share[:, 0] * (WIDE - 2.0 * RIM), HIGH - RIM - share[:, 1] * (HIGH - 2.0 * RIM)
    parts = [
        f'<path d="M{RIM - 6},{RIM - 16}V{HIGH - RIM + 6}H{WIDE - RIM + 16}" fill="none" stroke="{QUIET_COLOUR}"/>'
    ]
    for k in range(len(every)):
        kept = k < len(front.members)
        parts.append(f'<circle cx="{x[k]:.1f}" cy="{y[k]:.1f}" r="5" fill="{LIMIT_COLOUR if kept else QUIET_COLOUR}"/>')
        parts += [_text(x[k] + 8.0, y[k] - 6.0, str(k + 1))] if kept else []
    for end, values_ in enumerate((low, high)):
        parts.append(_text(RIM + end * (WIDE - 2.0 * RIM), HIGH - 28.0, number(float(values_[0])), "middle"))
        parts.append(_text(RIM - 10.0, HIGH - RIM - end * (HIGH - 2.0 * RIM), number(float(values_[1])), "end"))
    parts += [_text(0.5 * WIDE, HIGH - 8.0, pair[0].key, "middle"), _text(RIM - 6.0, 24.0, pair[1].key)]
    label = f"{pair[1].key} against {pair[0].key}; grey: not kept"
    box = f'viewBox="0 0 {WIDE:.0f} {HIGH:.0f}" style="max-width: {WIDE:.0f}px"'
    return (
        f'<figure><svg {box} role="img" aria-label="{label}">{"".join(parts)}</svg>'
        f'<figcaption class="caption">{label}</figcaption></figure>'
    )


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="13" text-anchor="{anchor}" fill="currentColor">{escape(text)}</text>'
    )


def _write(path: Path, text: str) -> None:
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
