"""Registry of the posts, those of other packages too; `write_post` and `read_post`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path

from pentapod.base.errors import InputError
from pentapod.base.registry import Registry
from pentapod.base.values import Value
from pentapod.machine.machine import Machine
from pentapod.program.commands import commanded, commands_digest, read_back, springs_digest
from pentapod.program.csv import csv_bytes
from pentapod.program.posts.files import write_files
from pentapod.program.posts.verified import VerdictContent, check_passed, marked_unverified
from pentapod.program.program import Program
from pentapod.toolpath.toolpath import Toolpath

LASER_POWER = "laser power"
"""Among what a post loses: the laser's power at each row. Spindle, coolant and tool are in its header all the same."""

GROUP = "pentapod.posts"
"""Entry points of this group name a `Post`, or a function without arguments that returns one."""


@dataclass(frozen=True, eq=False)
class PostInput(Value):
    """What a post writes. machine: for which the program was made. toolpath: as placed, machine frame.

    sha256: of the file from which the program was read; None where it is what `write_csv` writes.

    >>> given = PostInput(program, machine)
    """

    program: Program
    machine: Machine | None = None
    toolpath: Toolpath | None = None
    sha256: str | None = None

    def the_machine(self) -> Machine:
        """Return the machine. Raises InputError where it is missing, or not that of the program."""
        if self.machine is None:
            raise InputError("this post needs the machine", key="machine", remedy="name it with --machine or --job")
        machine = self.program.machine(self.machine)
        if machine.digest != self.program.provenance.machine_digest:
            raise InputError(
                "this is not the machine that the program was made for", key="machine_digest", value=machine.digest,
                expected=self.program.provenance.machine_digest,
                remedy="give the job with --job: it may change the tool or the controller's period",
            )  # fmt: skip
        return machine

    def the_toolpath(self) -> Toolpath:
        """Return the toolpath as placed. Raises InputError where there is none."""
        if self.toolpath is None:
            raise InputError("this post needs the toolpath", key="plan", remedy="give the run's plan.npz with --plan")
        return self.toolpath


@dataclass(frozen=True)
class Post(Value):
    """A format for a controller or another program.

    write: returns contents by file name, "folder/name" for files in folders; same input, same bytes. A content that
    starts with "#!" becomes an executable file. read: from the folder to the program, or to the toolpath where the post
    writes that; raises ProgramError or ToolpathError with file and line. loses: what cannot be read back, in words.
    takes_toolpath: whether the post needs the toolpath as well as the program. readings: whether its rows are what the
    legs read, not what drives are told.
    """

    name: str
    about: str
    write: Callable[[PostInput], dict[str, bytes]]
    read: Callable[[Path], Program | Toolpath]
    loses: frozenset[str] = field(default=frozenset())
    takes_toolpath: bool = False
    readings: bool = False


POSTS = Registry("post", GROUP, Post)
"""The posts by name: those of pentapod, then those of other packages."""


def register(post: Post) -> Post:
    """Add a post to `POSTS` and return it."""
    return POSTS.register(post.name, post)


def post_names() -> list[str]:
    """Return the names of all posts, those of other packages last.

    >>> "linuxcnc" in post_names()
    True
    """
    return list(POSTS)


def find_post(name: str) -> Post:
    """Return the post of this name. Raises InputError: unknown, or another package's that cannot be loaded."""
    return POSTS.find(name, key="to")


def write_post(
    given: PostInput, name: str, folder: str | Path, *, verdict: VerdictContent | None = None, unverified: bool = False
) -> list[Path]:
    """Write the files of a post into a folder, created if missing, and return their paths.

    verdict: verdict.json, or its content; passed for exactly this program. unverified: write without one; then every
    file says so in its first line (scripts, and G-code after "%", in their second). Nothing is written unless all
    contents could be made. Raises InputError: no passed verdict on this program, an unknown post, one that cannot
    be marked as unverified, a machine or toolpath that is missing, a folder that cannot be written.

    >>> files = write_post(PostInput(program, machine), "pvt", "pvt", unverified=True)
    >>> [file.name for file in files]
    ['program.pvt.csv']
    """
    post = find_post(name)
    if not unverified:
        if verdict is None:
            remedy = "name the verdict.json of the program, or insist with unverified=True"
            raise InputError("there is no verdict on this program", key="verdict", remedy=remedy)
        springs = "" if given.machine is None else springs_digest(given.program, given.machine)
        check_passed(verdict, given.sha256 or sha256(csv_bytes(given.program)).hexdigest(), springs=springs)
    program = _rows(given, post)
    if LASER_POWER in post.loses:
        program = replace(program, laser_power=None)
    source = replace(program.provenance, unverified=unverified)
    contents = post.write(replace(given, program=replace(program, provenance=source)))
    if unverified:
        contents = {relative: marked_unverified(relative, content) for relative, content in contents.items()}
    return write_files(contents, folder)


def _rows(given: PostInput, post: Post) -> Program:
    """Return the program with the rows that a post writes.

    Raises InputError where they depend on the machine, and it is missing or not that of the program.
    """
    program, machine = given.program, given.machine
    if post.takes_toolpath:  # it asks for the machine by itself
        return program
    if program.provenance.compensation or (machine is not None and machine.leg_model.is_needed):
        machine = given.the_machine()
    if post.readings:
        return program if machine is None else read_back(program, machine)
    return commanded(program, machine)


def read_post(folder: str | Path, name: str, machine: Machine | None = None) -> Program | Toolpath:
    """Return what a post's folder holds. machine: whose leg model made commands of readings, where it has one.

    Raises InputError with file and line; where the commands were made by another leg model.

    >>> files = write_post(PostInput(program, machine), "npz", "npz", unverified=True)
    >>> read_post("npz", "npz").legs.shape == program.legs.shape
    True
    """
    post = find_post(name)
    found = post.read(Path(folder))
    if machine is None or post.readings or not isinstance(found, Program):
        return found
    if not found.provenance.commands:  # a format that loses it: a post writes commands
        source = replace(found.provenance, commands=commands_digest(found, machine))
        found = replace(found, provenance=source)
    return read_back(found, machine)
