"""Words of Sinumerik 840D: names with arguments, values after an equals sign, and variables that hold numbers.

A variable may be set to a number and used as a value, as posts do for the home position and the tolerance; any other
expression is an error.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

from pentapod.base.files import number_in
from pentapod.toolpath.formats.gcode.language.blocks import Block, Word, Wrong, ascii_only
from pentapod.toolpath.formats.gcode.language.vocabulary import IDLE_SETTINGS

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:EX[+-]?[0-9]+)?"
_SET = re.compile(r"([A-Z_$][A-Z0-9_$]*(?:\[[A-Z0-9_]*\])?)\s*=\s*")
_CALL = re.compile(r"([A-Z_$][A-Z0-9_$]*)\s*\(")
_WORD = re.compile(rf"([A-Z])({_NUMBER})")
_NAME = re.compile(r"[A-Z_$][A-Z0-9_$]*:?")
_VALUE = re.compile(_NUMBER)
_DECLARED = re.compile(rf"([A-Z_][A-Z0-9_]*)(?:\s*=\s*({_NUMBER}))?")
_HOW = ("AC", "IC", "DC", "ACP", "ACN")
_FLOW = frozenset({
    "IF", "ELSE", "ENDIF", "GOTO", "GOTOF", "GOTOB", "GOTOC", "FOR", "ENDFOR", "WHILE", "ENDWHILE", "REPEAT", "REPEATB",
    "UNTIL", "LOOP", "ENDLOOP", "CASE", "PROC", "CALL", "EXTCALL", "PCALL", "EXTERN",
})  # fmt: skip
_LONGEST_SHOWN = 20


@dataclass
class SinumerikLines:
    """Lines of a program as blocks. variables: those that were set to a number so far; declared: names of others."""

    wrong: Wrong
    variables: dict[str, float] = field(default_factory=dict[str, float])
    declared: set[str] = field(default_factory=set[str])

    def block(self, text: str, line: int) -> Block:
        """Return the words of a line. Raises ToolpathError for expressions, jumps and calls of other programs."""
        code, comment = _without_comment(text)
        code = ascii_only(code, line, self.wrong).strip()
        skippable = code.startswith("/")
        code = code.lstrip("/0123456789 ") if skippable else code
        shown = code.upper()
        words: list[Word] = []
        position = 0
        while position < len(code):
            if code[position].isspace():
                position += 1
                continue
            word, position = self._word(code, shown, position, line)
            if word is None:  # a declaration, to the line's end
                break
            if word.address:
                words.append(word)
        return Block(line, words, skippable, (comment,) if comment else ())

    def _word(self, code: str, shown: str, position: int, line: int) -> tuple[Word | None, int]:
        """Return a word and where it ends; without an address where there is nothing to do, None for a declaration."""
        if match := _SET.match(shown, position):
            return self._set(match[1], code, shown, match.end(), line)
        if match := _CALL.match(shown, position):
            arguments, end = self._arguments(code, match.end(), line)
            self._check_flow(match[1], line)
            values = tuple(self._known(text) for text in arguments)
            return Word(match[1], math.nan, arguments=values, text=code[position:end][:_LONGEST_SHOWN]), end
        if match := _WORD.match(shown, position):
            return Word(match[1], _number(match[2]), text=match[0]), match.end()
        if match := _NAME.match(shown, position):
            name = match[0]
            if name == "DEF":
                self._declare(shown[match.end() :])
                return None, len(code)
            self._check_flow(name, line)
            return Word(name, math.nan, text=name), match.end()
        text = code[position:].split(maxsplit=1)[0][:_LONGEST_SHOWN]
        raise self.wrong("not a word with a number", line, text, expected="words such as X12.5 or X=12.5")

    def _set(self, name: str, code: str, shown: str, start: int, line: int) -> tuple[Word, int]:
        if shown.startswith('"', start):
            end = shown.find('"', start + 1)
            if end < 0:
                raise self.wrong("a text that does not end", line, name)
            return Word(
                name, math.nan, arguments=(code[start + 1 : end],), text=f"{name}={code[start : end + 1]}"
            ), end + 1
        how, value, end = "", math.nan, start
        if match := _CALL.match(shown, start):
            arguments, end = self._arguments(code, match.end(), line)
            how = match[1]
            if how in _HOW and len(arguments) == 1:
                number = number_in(self._known(arguments[0]))
                value = math.nan if number is None else number
        elif match := _VALUE.match(shown, start):
            value, end = _number(match[0]), match.end()
        elif match := _NAME.match(shown, start):
            value, end = self.variables.get(match[0], math.nan), match.end()
        rest = shown[end:].lstrip()
        if math.isnan(value) or rest.startswith(tuple("+-*/")):
            what = "an expression, or a variable without a number: its value is known to the controller only"
            raise self.wrong(
                what, line, code[start - len(name) - 1 :][:_LONGEST_SHOWN].strip(), remedy="export numbers"
            )
        text = f"{name}={code[start:end].strip()}"
        if len(name) == 1 or name in _VALUES:
            return Word(name, value, how, text=text), end
        if name.startswith("S") and name[1:].isdigit():
            return Word("S", value, text=text), end
        if name.startswith("M") and name[1:].isdigit():
            return Word("M", value, text=text), end
        base = name.partition("[")[0]
        if base.startswith("_") or base in self.declared or (base[0] == "R" and base[1:].isdigit()):
            self.variables[name] = value
        elif base not in IDLE_SETTINGS:
            raise self.wrong("a word that is not read", line, text[:_LONGEST_SHOWN])
        return Word("", math.nan), end

    def _declare(self, text: str) -> None:
        """Keep the names of a declaration such as DEF REAL depth=5, width, and their values."""
        for name, value in _DECLARED.findall(text):
            self.declared.add(name)
            if value:
                self.variables[name] = _number(value)

    def _arguments(self, code: str, start: int, line: int) -> tuple[list[str], int]:
        """Return the arguments of a call that begins before `start`, and where it ends."""
        arguments, depth, quoted, begun = list[str](), 1, False, start
        for position in range(start, len(code)):
            letter = code[position]
            if letter == '"':
                quoted = not quoted
            elif quoted:
                continue
            elif letter == "(":
                depth += 1
            elif letter == ")":
                depth -= 1
                if depth == 0:
                    last = code[begun:position].strip()
                    return [*arguments, last] if last or arguments else [], position + 1
            elif letter == "," and depth == 1:
                arguments.append(code[begun:position].strip())
                begun = position + 1
        raise self.wrong("a parenthesis that does not end", line, code[max(start - 9, 0) : start])

    def _known(self, text: str) -> str:
        """Return an argument, with the number of a variable in its place."""
        value = self.variables.get(text.upper())
        return text if value is None else repr(value)

    def _check_flow(self, name: str, line: int) -> None:
        if name.endswith(":") or name in _FLOW:
            what = "a jump, a loop or another program: the path depends on what the controller computes"
            raise self.wrong(what, line, name, remedy="export without subprograms and jumps")


_VALUES = frozenset({"CR", "TURN", "A3", "B3", "C3", "A2", "B2", "C2", "I1", "J1", "K1", "RPL", "AP", "RP", "SPOS"})
"""Names of more than a letter whose values are words; other names are variables."""


def _number(text: str) -> float:
    return float(text.replace("EX", "E"))


def _without_comment(text: str) -> tuple[str, str]:
    """Return a line and its comment; a semicolon in a text is none."""
    if ";" not in text:
        return text, ""
    quoted = False
    for position, letter in enumerate(text):
        if letter == '"':
            quoted = not quoted
        elif letter == ";" and not quoted:
            return text[:position], text[position + 1 :]
    return text, ""
