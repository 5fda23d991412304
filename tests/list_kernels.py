"""Write the list of kernels that `pentapod warm-up` compiles, from the cache that tests or jobs have filled.

`make kernels` runs the fast tests with an empty cache, then this. numba's index files are read, a file for each kernel.
"""

from __future__ import annotations

import json
import pickle
import sys
from pathlib import Path
from typing import Any

from numba import types

from pentapod.numerics.warm_up import SIGNATURES, types_of

SOURCES = SIGNATURES.parents[1]


def written(kind: Any) -> Any:
    """Return the form of a type that `types_of` reads. Raises ValueError where there is none."""
    if isinstance(kind, types.Array):
        return ["array", written(kind.dtype), kind.ndim, kind.layout, kind.mutable]
    if isinstance(kind, (types.NamedTuple, types.NamedUniTuple)):
        named = kind.instance_class
        return [f"{named.__module__.removeprefix('pentapod.')}:{named.__name__}", *map(written, kind.types)]
    if isinstance(kind, types.BaseTuple):
        return ["tuple", *map(written, kind.types)]
    form = {"none": "none", "bool": "boolean"}.get(str(kind), str(kind))
    if isinstance(kind, types.Literal) or getattr(types, form, None) != kind:
        raise ValueError(f"{kind} has no written form")
    return form


def found(cache: Path) -> dict[str, list[list[Any]]]:
    """Return the signatures of all kernels in the cache that are not private to their files."""
    modules = {file.stem: [] for file in SOURCES.rglob("*_kernels.py")}
    for file in SOURCES.rglob("*_kernels.py"):
        modules[file.stem].append(file)
    listed: dict[str, list[list[Any]]] = {}
    for index in sorted(cache.rglob("*.nbi")):
        module, name = index.name.split(".")[0], index.name.split(".")[1].rpartition("-")[0]
        if module not in modules:
            continue  # of a test
        (source,) = (f for f in modules[module] if f.parent.name == index.parent.name.rpartition("_")[0])
        if name.startswith("_"):
            continue
        with index.open("rb") as stream:
            pickle.load(stream)  # the version of numba
            calls = pickle.loads(stream.read())[1]
        forms: list[list[Any]] = []
        for signature, *_ in calls:
            try:
                form = [written(kind) for kind in signature]
            except ValueError:
                continue  # of a call with constants, by another kernel
            assert tuple(types_of(part) for part in form) == tuple(signature)
            forms.append(form)
        if forms:
            dotted = ".".join(source.relative_to(SOURCES).with_suffix("").parts)
            listed[f"{dotted}:{name}"] = sorted(forms, key=str)
    return listed


if __name__ == "__main__":
    content = found(Path(sys.argv[1]))
    blocks = []
    for name in sorted(content):
        calls = ",\n".join(f"  {json.dumps(call)}" for call in content[name])
        blocks.append(f"{json.dumps(name)}: [\n{calls}\n]")
    SIGNATURES.write_text("{\n" + ",\n".join(blocks) + "\n}\n", encoding="utf-8")
    sys.stdout.write(f"{SIGNATURES.name}: {sum(map(len, content.values()))} signatures of {len(content)} kernels\n")
