"""What a user should know about how a file was read."""

from __future__ import annotations

from collections.abc import Sequence

from pentapod.toolpath.formats.gcode.tracer import Tracer
from pentapod.toolpath.formats.moves import Moves

_MOST = 6
"""Lines, words or tools that a note names."""

_SENTENCES = {
    "home": "moves to the home position are left out, the tool passes over the part instead",
    "positioning": "positioning moves to places that only the machine knows are left out, the tool passes over the part"
    " instead",
    "tool change": "at a tool change the tool passes over the part",
    "stop": "the stops M0 and M1 are kept as words, and nothing stops there",
    "skip": "blocks that may be skipped are read",
    "other tool": "moves of other tools are left out",
}


def notes(tracer: Tracer, moves: Moves) -> tuple[str, ...]:
    """Return the notes on a file that was read."""
    found = [f"{sentence} ({_lines(tracer.told[key])})" for key, sentence in _SENTENCES.items() if key in tracer.told]
    functions = {
        key.removeprefix("function "): lines for key, lines in tracer.told.items() if key.startswith("function ")
    }
    if functions:
        named = ", ".join(f"{word} ({_lines(lines)})" for word, lines in list(functions.items())[:_MOST])
        found.append(f"functions of the machine's builder are kept as words, and not judged: {named}")
    words = list(dict.fromkeys(word for said in moves.words.values() for word in said if word not in functions))
    if words:
        more = f" and {len(words) - _MOST} more" if len(words) > _MOST else ""
        found.append(f"spindle, coolant and tool are kept as words: {', '.join(words[:_MOST])}{more}")
    if len(tracer.tools) > 1:
        named = ", ".join(
            f"{tool or 'no tool'} (from line {line})" for tool, line in list(tracer.tools.items())[:_MOST]
        )
        found.append(
            f"problem: {len(tracer.tools)} tools cut: {named}; the job's tool is taken for all: name one by tool = "
            f'"{next(iter(tracer.tools))}" in [toolpath], and make a job for each'
        )
    if any(tracer.at.offsets) and tracer.at.first_system is not None:
        found.append(f"the frame of the mesh is that of {tracer.at.first_system[0]}")
    return tuple(found)


def _lines(lines: Sequence[int]) -> str:
    lines = list(dict.fromkeys(lines))
    more = f" and {len(lines) - _MOST} more" if len(lines) > _MOST else ""
    return f"line{'s' if len(lines) > 1 else ''} {', '.join(map(str, lines[:_MOST]))}{more}"
