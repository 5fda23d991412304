"""The posts by name, those of other packages too; writing a folder and reading it back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path

from pentapod.base.errors import InputError, ProgramError
from pentapod.base.files import atomic_write, read_bytes
from pentapod.base.registry import Registry
from pentapod.base.values import Value
from pentapod.machine.machine import Machine
from pentapod.program.csv import csv_bytes
from pentapod.program.judged import Judgement, check_passed
from pentapod.program.posts.unverified import told_unverified
from pentapod.program.program import Program
from pentapod.toolpath.toolpath import Toolpath

GROUP = "pentapod.posts"
"""Entry points of this group name a `Post`, or a function without arguments that returns one."""

_INSIST = "name the verdict.json of the program, or insist with unverified=True"


@dataclass(frozen=True, eq=False)
class PostInput(Value):
    """What there is to write. machine: as the program was made for it. toolpath: as placed, machine frame.

    sha256: of the file that the program was read from; None where it is what `write_csv` writes.
    """

    program: Program
    machine: Machine | None = None
    toolpath: Toolpath | None = None
    sha256: str | None = None

    def the_machine(self) -> Machine:
        """Return the machine. Raises InputError where there is none, or not that of the program."""
        if self.machine is None:
            raise InputError("this post needs the machine", key="machine", remedy="name it with --machine or --job")
        machine = self.program.machine(self.machine)
        if machine.digest != self.program.provenance.machine_digest:
            raise InputError(
                "this is not the machine that the program was made for",
                key="machine_digest",
                value=machine.digest,
                expected=self.program.provenance.machine_digest,
                remedy="give the job with --job: it may change the tool or the controller's period",
            )
        return machine

    def the_toolpath(self) -> Toolpath:
        """Return the toolpath as placed. Raises InputError where there is none."""
        if self.toolpath is None:
            raise InputError("this post needs the toolpath", key="plan", remedy="give the run's plan.npz with --plan")
        return self.toolpath


@dataclass(frozen=True)
class Post(Value):
    """A format that a controller or another program takes.

    write: what there is → contents by file name, "folder/name" for files in folders; same input, same bytes. A
    content that starts with "#!" becomes an executable file.
    read: the folder → the program, or the toolpath where it is that what the post writes. Raises ProgramError
    or ToolpathError with file and line.
    loses: what cannot be read back, in words. takes_toolpath: whether the toolpath is looked for, beside the program.
    """

    name: str
    about: str
    write: Callable[[PostInput], dict[str, bytes]]
    read: Callable[[Path], Program | Toolpath]
    loses: frozenset[str] = field(default=frozenset())
    takes_toolpath: bool = False


POSTS = Registry("post", GROUP, Post)
"""The posts by name: those that pentapod brings, then those of other packages."""


def register(post: Post) -> Post:
    """Add a post to `POSTS` and return it."""
    return POSTS.register(post.name, post)


def post_names() -> list[str]:
    """Return the names of all posts, those of other packages last."""
    return list(POSTS)


def find_post(name: str) -> Post:
    """Return the post of this name. Raises InputError: unknown, or another package's that cannot be loaded."""
    return POSTS.find(name, key="to")


def write_post(
    given: PostInput,
    name: str,
    folder: str | Path,
    *,
    verdict: Judgement | None = None,
    unverified: bool = False,
) -> list[Path]:
    """Write the files of a post into a folder, made where it is missing, and return their paths.

    verdict: what says that exactly this program was judged and passed: a verdict.json, or its content. unverified:
    write without one; then every file says so in its first line (scripts, and G-code after "%", in their second).
    Nothing is written unless everything could be made. Raises InputError: no passed verdict on this program, an unknown
    post, one that cannot say that it is unverified, a machine or toolpath that is missing, a folder that cannot be
    written.
    """
    post = find_post(name)
    if not unverified:
        if verdict is None:
            raise InputError("nothing says that this program was judged", key="verdict", remedy=_INSIST)
        check_passed(verdict, given.sha256 or sha256(csv_bytes(given.program)).hexdigest())
    source = replace(given.program.provenance, unverified=unverified)
    contents = post.write(replace(given, program=replace(given.program, provenance=source)))
    if unverified:
        contents = {relative: told_unverified(relative, content) for relative, content in contents.items()}
    made: list[Path] = []
    for relative, content in contents.items():
        path = Path(folder) / relative
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            reason = (error.strerror or str(error)).lower()
            raise InputError(
                f"the folder cannot be made: {reason}", file=path.parent, remedy="choose another"
            ) from error
        with atomic_write(path) as temporary:
            temporary.write_bytes(content)
            if content.startswith(b"#!"):
                temporary.chmod(temporary.stat().st_mode | 0o111)
        made.append(path)
    return made


def read_post(folder: str | Path, name: str) -> Program | Toolpath:
    """Return what a post's folder holds. Raises InputError with file and line."""
    return find_post(name).read(Path(folder))


def read_file(path: Path) -> bytes:
    """Return the bytes of a file. Raises ProgramError where it cannot be read."""
    return read_bytes(path, ProgramError, "a file of this post")
