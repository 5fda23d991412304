"""Process: spindle, coolant, tool and laser, as words of G-code say them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from pentapod.base.values import Value

_PLAIN = re.compile(r"([MST])0*([0-9.]+)")
_LASER = re.compile(r"M6[78] E0 Q([0-9]*\.?[0-9]+)")
_TURNS, _COOLANTS = ("M3", "M4", "M5"), ("M7", "M8", "M9")
_POWER_DECIMALS = 6


@dataclass(frozen=True)
class Process(Value):
    """What is in the spindle, and what is on; "" and None where no word has said it.

    tool: number after T. mounted: whether M6 has brought it. speed: number after S. spindle: M3, M4 or M5. coolant:
    those of M7 and M8 that are on, or M9. laser: share of full power, 0 to 1, as the analog output 0 (M67 E0 Q...).

    >>> Process().after(("T3", "M6", "S12000", "M3")).words
    ('T3', 'M6', 'S12000', 'M3')
    """

    tool: str = ""
    mounted: bool = False
    speed: str = ""
    spindle: str = ""
    coolant: tuple[str, ...] = ()
    laser: float | None = None

    def after(self, words: Iterable[str]) -> Process:
        """Return what holds after these words; words about something else change nothing."""
        state = self
        for word in words:
            plain = plain_word(word)
            if (power := laser_power(word)) is not None:
                state = replace(state, laser=power)
            elif plain in _TURNS:
                state = replace(state, spindle=plain)
            elif plain in _COOLANTS:
                on = () if plain == "M9" or state.coolant == ("M9",) else state.coolant
                state = replace(state, coolant=tuple(sorted({*on, plain})))
            elif plain == "M6":
                state = replace(state, mounted=True)
            elif plain[:1] == "S":
                state = replace(state, speed=plain[1:])
            elif plain[:1] == "T":
                state = replace(state, tool=plain[1:], mounted=False)
        return state

    @property
    def words(self) -> tuple[str, ...]:
        """The words that bring a machine of which nothing is known to this state."""
        tool = (f"T{self.tool}",) if self.tool else ()
        speed = (f"S{self.speed}",) if self.speed else ()
        spindle = (self.spindle,) if self.spindle else ()
        laser = () if self.laser is None else (laser_word(self.laser),)
        return (*tool, *(("M6",) if self.mounted else ()), *speed, *spindle, *self.coolant, *laser)

    def __str__(self) -> str:
        """Return it in words: "tool 3, spindle 12000 rpm, coolant M8"."""
        turns = {"M3": "", "M4": " anticlockwise"}
        found = [f"tool {self.tool}"] if self.tool else []
        if self.spindle in turns:
            found.append(f"spindle {self.speed + ' rpm' if self.speed else 'on'}{turns[self.spindle]}")
        found += [f"coolant {' and '.join(self.coolant)}"] if self.coolant not in ((), ("M9",)) else []
        return ", ".join(found)


def plain_word(word: str) -> str:
    """Return an M, S or T word without leading zeros; "" for any other."""
    match = _PLAIN.fullmatch(word)
    return f"{match[1]}{match[2]}" if match else ""


def subject(word: str) -> str:
    """Return what a word is about: "tool", "spindle", "coolant" or "laser"; "" for something else."""
    plain = plain_word(word)
    if laser_power(word) is not None:
        return "laser"
    if plain in _COOLANTS:
        return "coolant"
    if plain in _TURNS or plain[:1] == "S":
        return "spindle"
    return "tool" if plain == "M6" or plain[:1] == "T" else ""


def laser_word(power: float) -> str:
    """Return the word that sets the laser to a share of full power, together with the next motion."""
    return f"M67 E0 Q{f'{power:.{_POWER_DECIMALS}f}'.rstrip('0').rstrip('.')}"


def laser_power(word: str) -> float | None:
    """Return the share of full power to which a word sets the laser; None for any other word, and beyond 0 to 1."""
    match = _LASER.fullmatch(word)
    power = float(match[1]) if match else None
    return power if power is not None and power <= 1.0 else None
