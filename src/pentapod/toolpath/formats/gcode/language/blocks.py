"""Words of G-code as Fanuc, LinuxCNC and their relatives write it: a letter and a number.

A variable (#1, #<depth>) may be set to a number and used as a value; any other expression is an error.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from pentapod.base.errors import ToolpathError
from pentapod.toolpath.formats.gcode.language.vocabulary import POLAR

_WORD = re.compile(r"\s*([A-Z])\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")
_NAME = r"#([0-9]+|<[A-Z0-9_ ]+>)"
_SET = re.compile(rf"\s*{_NAME}\s*=\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))\s*$")
_USED = re.compile(rf"\s*([A-Z])\s*([+-]?){_NAME}")
_SUBPROGRAM = re.compile(r"O\s*(?:<|[0-9]+\s*[A-Z<\[])")
_SKIP = re.compile(r"/[0-9]?")
_LONGEST_SHOWN = 20
"""Characters of a word that a message shows."""


class Word(NamedTuple):
    """A word of a block: G1, X12.5, or a command with its arguments, such as CYCLE800(…), whose value is NaN.

    how: how the value is meant where the word says it: AC, IC, DC, ACP or ACN. arguments: those of a command, as text.
    """

    address: str
    value: float
    how: str = ""
    arguments: tuple[str, ...] = ()
    text: str = ""

    def __str__(self) -> str:
        return self.text or f"{self.address}{self.value:g}"


class Block(NamedTuple):
    """The words of a line. skippable: it begins with a slash. comments: those of the line."""

    line: int
    words: list[Word]
    skippable: bool = False
    comments: tuple[str, ...] = ()


Wrong = Callable[..., ToolpathError]
"""Makes the error of a word: what, line, word."""


@dataclass
class PlainLines:
    """Lines of a program as blocks. variables: those that were set to a number so far."""

    wrong: Wrong
    variables: dict[str, float] = field(default_factory=dict[str, float])

    def block(self, text: str, line: int) -> Block:
        """Return the words of a line. Raises ToolpathError for anything but words with numbers, and other scripts."""
        comments: tuple[str, ...] = ()
        if "(" in text or ";" in text or ")" in text:
            text, comments = _without_comments(text, line, self.wrong)
        code = ascii_only(text, line, self.wrong).upper().strip()
        skippable = code.startswith("/")
        if skippable:
            code = _SKIP.sub("", code, count=1).strip()
        if code.startswith(":"):  # the number of the program, as ISO has it
            code = "O" + code[1:]
        if _SUBPROGRAM.match(code):
            raise self.wrong(
                "a loop or subprogram of the controller: the path depends on what it computes", line,
                code[:_LONGEST_SHOWN], remedy="export without subprograms",
            )  # fmt: skip
        words: list[Word] = []
        position, end = 0, len(code)
        while position < end:
            match = _WORD.match(code, position)
            if match is not None:
                words.append(Word(match[1], float(match[2]), text=match[0].lstrip()))
            elif match := _SET.match(code, position):
                self.variables[match[1]] = float(match[2])
            elif (match := _USED.match(code, position)) and match[3] in self.variables:
                value = self.variables[match[3]]
                words.append(Word(match[1], -value if match[2] == "-" else value, text=match[0].lstrip()))
            else:
                raise _no_word(code[position:].split(maxsplit=1)[0][:_LONGEST_SHOWN], line, self.wrong)
            position = match.end()
        return Block(line, words, skippable, comments)


def ascii_only(text: str, line: int, wrong: Wrong) -> str:
    """Return a text. Raises ToolpathError where it holds other letters than those of commands.

    Capitals of some letters of other scripts are letters of commands.
    """
    if not text.isascii():
        letter = next(letter for letter in text if not letter.isascii())
        raise wrong("a letter or digit that G-code does not have", line, letter)
    return text


def _no_word(text: str, line: int, wrong: Wrong) -> ToolpathError:
    if text.startswith(("@", "^")):
        what, remedy = POLAR
        return wrong(what, line, text, remedy=remedy)
    if "[" in text:
        what = "an expression with a variable" if "#" in text else "an expression"
        return wrong(f"{what}: expressions are not computed", line, text, remedy="export numbers")
    if "#" in text:
        what = "a variable: its value is known to the controller only"
        return wrong(what, line, text, remedy="export numbers")
    if text.startswith(","):
        what = "a corner that the controller rounds or cuts off"
        return wrong(what, line, text, remedy="export the arc or the line itself")
    if "=" in text or text.startswith(("CYCLE", "TRA", "SUPA", "MSG")):
        what = "not a word with a number"
        return wrong(what, line, text, remedy='for a program of Sinumerik give format = "sinumerik"')
    return wrong("not a word with a number", line, text, expected="words such as X12.5; no expressions")


def _without_comments(text: str, line: int, wrong: Wrong) -> tuple[str, tuple[str, ...]]:
    """Return a line without what stands in parentheses or after a semicolon, and these comments."""
    kept: list[str] = []
    comments: list[str] = []
    depth = start = 0
    for position, letter in enumerate(text):
        if letter == "(":
            if depth == 0:
                kept.append(text[start:position])
                start = position + 1
            depth += 1
        elif letter == ")":
            depth -= 1
            if depth < 0:
                break
            if depth == 0:
                comments.append(text[start:position])
                start = position + 1
        elif letter == ";" and depth == 0:
            kept.append(text[start:position])
            return "".join(kept), (*comments, text[position + 1 :])
    if depth:
        raise wrong("a comment that does not end, or did not begin", line, "(" if depth > 0 else ")")
    return "".join([*kept, text[start:]]), tuple(comments)
