"""Spindle, coolant and tool in APT, as the words of G-code that a toolpath keeps."""

from __future__ import annotations

from collections.abc import Sequence

from pentapod.base.files import number_in

_COOLANT = {"ON": "M8", "FLOOD": "M8", "MIST": "M7", "OFF": "M9"}
_STOPS = {"STOP": "M0", "OPSTOP": "M1"}
_STATEMENTS = {
    "M0": "STOP", "M1": "OPSTOP", "M5": "SPINDL/OFF", "M7": "COOLNT/MIST", "M8": "COOLNT/ON", "M9": "COOLNT/OFF"
}  # fmt: skip
_SURFACE_SPEED = frozenset({"SFM", "SMM", "MAXRPM"})
_TURNS = {"M3": "CLW", "M4": "CCLW"}


def words_of(statement: str, values: Sequence[str]) -> tuple[str, ...] | None:
    """Return what a statement says of spindle, coolant and tool, as words such as S12000; None where it is not known.

    values: what follows the slash.
    """
    said = [value.upper() for value in values]
    number = next((value for value in said if number_in(value) is not None), None)
    if statement in _STOPS:
        return (_STOPS[statement],)
    if statement == "LOADTL" and number is not None:
        return f"T{number}", "M6"
    if statement == "COOLNT":
        found = next((_COOLANT[value] for value in said if value in _COOLANT), None)
        return None if found is None else (found,)
    if statement == "SPINDL" and "OFF" in said:
        return ("M5",)
    if statement == "SPINDL" and not _SURFACE_SPEED & set(said) and (number is not None or "ON" in said):
        speed = () if number is None else (f"S{number}",)
        return (*speed, "M4" if "CCLW" in said else "M3")
    return None


def statements_of(words: Sequence[str]) -> list[str]:
    """Return the statements that say what words say; words of no other statement are inserted."""
    found, speed, tool = list[str](), "", ""
    for word in words:
        plain = word[:1] + (word[1:].lstrip("0") or "0")
        if plain[0] in "ST" and number_in(plain[1:]) is not None:
            speed, tool = (plain[1:], tool) if plain[0] == "S" else (speed, plain[1:])
        elif plain in _TURNS:
            found.append(f"SPINDL/{speed + ',RPM' if speed else 'ON'},{_TURNS[plain]}")
            speed = ""
        elif plain == "M6" and tool:
            found.append(f"LOADTL/{tool}")
            tool = ""
        else:
            found.append(_STATEMENTS.get(plain, f"INSERT/{word}"))
    return found + [f"INSERT/{letter}{value}" for letter, value in (("T", tool), ("S", speed)) if value]
