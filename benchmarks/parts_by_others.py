"""Parts by others, each as a user takes it up: `pentapod new PART`, then `pentapod plan`, every key at its default.

    python benchmarks/parts_by_others.py FOLDER... [--plain]

Each mesh of the folders is scaled to fit the machine `desk`, if it is wider or flatter than a part of 60 mm, and
planned in a process of its own, with limits on its memory and its seconds. The table says what became of it: passed,
refused (and what was said first), or a program that was withheld, since its own verdict fails. With --plain, the job is
written by hand: a ball cutter of 6 mm, 3 mm between passes, and nothing else.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SUFFIXES = (".stl", ".ply", ".obj")
COMMAND = (sys.executable, "-c", "import sys; from pentapod.cli.main import main; sys.exit(main())")
PLAIN = """\
[part]
mesh = "{mesh}"
unit = "mm"

[machine]
name = "desk"

[tool]
type = "ball"
diameter_mm = 6

[toolpath]
stepover_mm = 3

[feed]
cut_mm_min = 1500
"""


@dataclass(frozen=True)
class Bounds:
    """Limits of each process: seconds of the processor, seconds on the clock, bytes of memory."""

    seconds: int
    waits: int
    memory: int


@dataclass(frozen=True)
class Outcome:
    """What became of a part, in a word; why; seconds of the processor and the largest memory in bytes."""

    word: str
    why: str
    seconds: float
    memory: float


def scaled(path: Path, folder: Path, width: float) -> Path:
    """Return a copy of a mesh, `width` mm wide where it is not between half of that and all of it."""
    import trimesh  # noqa: PLC0415

    shape = trimesh.load_mesh(path, process=False)
    wide = float(np.ptp(shape.vertices, axis=0)[:2].max())
    if not 0.5 * width <= wide <= width:
        shape.apply_scale(width / wide)
    copy = folder / f"{path.stem}.stl"
    shape.export(copy)
    return copy


def run(words: Sequence[str | Path], folder: Path, bounds: Bounds) -> tuple[int, str, float, float]:
    """Run a command of pentapod; return its exit code, what it said, seconds of the processor and bytes of memory."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with (folder / "said.txt").open("w+", encoding="utf-8") as said:
        started = time.monotonic()
        child = subprocess.Popen(
            [*COMMAND, *map(str, words)], cwd=folder, stdout=said, stderr=subprocess.STDOUT, env=environment
        )
        resource.prlimit(child.pid, resource.RLIMIT_AS, (bounds.memory, bounds.memory))
        resource.prlimit(child.pid, resource.RLIMIT_CPU, (bounds.seconds, bounds.seconds + 5))
        while True:
            pid, status, usage = os.wait4(child.pid, os.WNOHANG)
            if pid:
                break
            if time.monotonic() - started > bounds.waits:
                child.kill()
            time.sleep(0.1)
        said.seek(0)
        text = said.read()
    return os.waitstatus_to_exitcode(status), text, usage.ru_utime + usage.ru_stime, 1024.0 * usage.ru_maxrss


def planned(mesh: Path, folder: Path, bounds: Bounds, *, plain: bool) -> Outcome:
    """Return what becomes of a part whose job is written and planned."""
    seconds = 0.0
    if plain:
        (folder / "job.toml").write_text(PLAIN.format(mesh=mesh.name), encoding="utf-8")
    else:
        code, said, seconds, memory = run(["new", mesh.name], folder, bounds)
        if code:
            return Outcome("refused by new", last_line(said), seconds, memory)
    job = next(folder.rglob("*.toml"))
    code, said, more, memory = run(["plan", job, "-o", folder / "out"], folder, bounds)
    withheld = any((folder / "out").rglob("withheld.csv"))
    if code < 0 or "MemoryError" in said:
        word, why = "out of time" if code < 0 else "out of memory", last_line(said)
    elif "Traceback" in said:
        word, why = "traceback", last_line(said)
    elif code > 1:
        word, why = "error", last_line(said)
    elif code == 0:
        word, why = "passed", ""
    else:
        word, why = "program withheld" if withheld else "refused", refusal(said)
    return Outcome(word, why, seconds + more, memory)


def last_line(said: str) -> str:
    """Return the last line that was said."""
    return (said.strip().splitlines() or [""])[-1].strip()


def refusal(said: str) -> str:
    """Return the first line of a refusal, and its first advice."""
    rows = said.strip().splitlines()
    first = next(
        (k for k, row in enumerate(rows) if "refused" in row.lower() or row.startswith("error")), len(rows) - 1
    )
    return " / ".join(row.strip() for row in rows[first : first + 2]) if rows else ""


def main() -> None:
    """Plan every part, print a line for each as it is done, and the count of each outcome."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", help="folders of meshes, or meshes")
    parser.add_argument("--plain", action="store_true", help="a job of a few keys in place of that of `pentapod new`")
    parser.add_argument("--width-mm", type=float, default=60.0)
    parser.add_argument("--seconds", type=int, default=300, help="of the processor, for each part")
    parser.add_argument("--waits", type=int, default=1200, help="seconds on the clock, for each part")
    parser.add_argument("--memory-gb", type=float, default=6.0)
    parser.add_argument("--keep", type=Path, help="folder in which jobs and results stay")
    parser.add_argument("--json", type=Path, help="file for the outcomes")
    options = parser.parse_args()
    bounds = Bounds(options.seconds, options.waits, int(options.memory_gb * 2**30))
    meshes = [
        path
        for given in options.folders
        for path in (sorted(given.iterdir()) if given.is_dir() else [given])
        if path.suffix.lower() in SUFFIXES
    ]
    found: dict[str, Outcome] = {}
    for path in meshes:
        with tempfile.TemporaryDirectory() as temporary:
            folder = (options.keep or Path(temporary)).resolve() / path.stem
            folder.mkdir(parents=True, exist_ok=True)
            found[path.stem] = one = planned(
                scaled(path, folder, options.width_mm), folder, bounds, plain=options.plain
            )
        said = one.why if len(one.why) <= 160 else f"{one.why[:157]}..."
        print(f"{path.stem:28} {one.word:16} {one.seconds:6.1f} s {one.memory / 2**30:5.2f} GB  {said}", flush=True)
    print(", ".join(f"{count} {word}" for word, count in Counter(one.word for one in found.values()).most_common()))
    if options.json:
        options.json.write_text(
            json.dumps({name: vars(one) for name, one in found.items()}, indent=1), encoding="utf-8"
        )


if __name__ == "__main__":
    main()
