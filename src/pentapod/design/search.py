"""The search: NSGA-II on a sample of poses that grows by the worst poses of the best designs; it can be resumed.

The search is a function of the design file. Every evaluation is kept in a file, in order; a search that goes on runs
again from the start and takes from it what is there. So it ends with the same bits, however often it was killed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.errors import InputError
from pentapod.base.progress import Progress, silent
from pentapod.base.values import Value
from pentapod.design.design_file import DesignFile
from pentapod.design.evaluation import FAR, Sample, evaluated, first_sample, shortfalls, worst_poses
from pentapod.design.part_poses import PartPoses
from pentapod.design.quantities import QUANTITIES

DESIGNS = "designs.bin"
"""The file of evaluations, within the folder of a search."""
SPREADS = (0.02, 0.05, 0.15)
"""The first designs are around the start, by these shares of the ranges (standard deviations)."""
WATCHED = 12
"""Designs of the front whose worst poses are looked for."""


@dataclass(frozen=True, eq=False)
class Found(Value):
    """What a search found. vectors (N, n), values (N, Q): designs that are in nothing worse than another one.

    They keep every need with the reserve, on the sample; the best of the first objective first. designs: how many were
    evaluated. sample: at the end.
    """

    vectors: Floats
    values: Floats
    designs: int
    sample: Sample


class Log:
    """Evaluations in a file, in order: rows of a design's vector and its quantities."""

    def __init__(self, path: Path, width: int) -> None:
        self._path, self._width = path, width
        raw = np.fromfile(path, dtype="<f8") if path.exists() else np.zeros(0)
        whole = len(raw) // width * width
        self._known = raw[:whole].reshape(-1, width)
        self.count = 0
        if whole * 8 != (path.stat().st_size if path.exists() else 0):  # a row was being written
            with path.open("r+b") as file:
                file.truncate(whole * 8)

    def values(self, sample: Sample, vectors: Floats) -> Floats:
        """Return the quantities of designs, from the file as far as it has them."""
        n, start = vectors.shape[1], self.count
        old = self._known[start : start + len(vectors)]
        same = np.array_equal(old[:, :n], vectors[: len(old)])
        if not same:  # of another machine, whose last bits differ
            with self._path.open("r+b") as file:
                file.truncate(start * self._width * 8)
            self._known, old = self._known[:start], self._known[:0]
        found = np.concatenate([old[:, n:], evaluated(sample, vectors[len(old) :])])
        with self._path.open("ab") as file:
            file.write(np.concatenate([vectors, found], axis=1)[len(old) :].astype("<f8").tobytes())
        self.count += len(vectors)
        return found


def search(file: DesignFile, folder: Path, progress: Progress = silent) -> Found:
    """Return the front that is found on the sample. folder: for what has been evaluated.

    Raises InputError: pymoo is not installed.
    """
    try:
        from pymoo.algorithms.moo.nsga2 import NSGA2  # noqa: PLC0415 - an extra
        from pymoo.core.evaluator import Evaluator  # noqa: PLC0415
        from pymoo.core.problem import Problem  # noqa: PLC0415
        from pymoo.problems.static import StaticProblem  # noqa: PLC0415
    except ImportError as error:
        raise InputError("pymoo is not installed", remedy='pip install "pentapod[design]"') from error

    unknowns, asked = file.unknowns, file.search
    sample = first_sample(file, PartPoses.of(file.jobs, file.part_poses))
    log = Log(folder / DESIGNS, len(unknowns.names) + len(QUANTITIES))
    problem: Any = Problem(
        n_var=len(unknowns.names), n_obj=len(file.objectives), n_ieq_constr=len(file.needs), xl=unknowns.low,
        xu=unknowns.high,
    )  # fmt: skip
    first: Any = _first(file)
    algorithm: Any = NSGA2(pop_size=asked.population, sampling=first)
    algorithm.setup(problem, termination=("n_gen", asked.generations), seed=asked.seed)

    def judged(designs: Any) -> None:
        values = log.values(sample, designs.get("X"))
        goals, missing = _goals(file, values), shortfalls(file.needs, values, reserve=True)
        static = StaticProblem(problem, F=goals, G=missing)
        Evaluator(skip_already_evaluated=False).eval(static, designs, skip_already_evaluated=False)
        designs.set("values", values)

    for generation in range(1, asked.generations + 1):
        with np.errstate(all="ignore"):  # its crossover
            designs = algorithm.ask()
            judged(designs)
            algorithm.tell(infills=designs)
        last = generation == asked.generations
        while last or generation % asked.exchange == 0:
            unit = _exchanged(file, sample, algorithm.pop, everyone=last)
            if len(unit) == len(sample.unit):
                break
            sample = replace(sample, unit=unit)
            judged(algorithm.pop)
            again = {"algorithm": algorithm, "random_state": algorithm.random_state}
            algorithm.pop = algorithm.survival.do(problem, algorithm.pop, n_survive=asked.population, **again)
            if not last:
                break
        progress("search", generation / asked.generations, _note(file, algorithm.pop, log.count))
    rows = _front(file, algorithm.pop)
    vectors, values = (np.array(algorithm.pop.get(name), dtype=np.float64) for name in ("X", "values"))
    return Found(vectors[rows], values[rows], log.count, sample)


def _first(file: DesignFile) -> Floats:
    """Return the first designs: the start, and others around it, near and far."""
    unknowns, count, rng = file.unknowns, file.search.population, np.random.default_rng(file.search.seed)
    start, span = unknowns.vector(), unknowns.high - unknowns.low
    spread = np.resize(SPREADS, count)[:, None]
    vectors = np.clip(start + spread * span * rng.standard_normal((count, len(span))), unknowns.low, unknowns.high)
    vectors[0] = start
    return vectors


def _goals(file: DesignFile, values: Floats) -> Floats:
    names = list(QUANTITIES)
    columns = [sense * values[:, names.index(name)] for name, sense in file.objectives]
    return np.nan_to_num(np.stack(columns, axis=1), nan=FAR)


def _front(file: DesignFile, designs: Any) -> list[int]:
    """Return rows of the designs that keep the needs and are in nothing worse than another; ordered."""
    values = np.array(designs.get("values"), dtype=np.float64)
    kept = np.flatnonzero((shortfalls(file.needs, values, reserve=True) <= 0.0).all(axis=1))
    goals = _goals(file, values[kept])
    best = kept[undominated(goals)]
    return sorted(best.tolist(), key=lambda row: (tuple(_goals(file, values[row][None])[0]), row))


def undominated(goals: Floats) -> Bools:
    """Return which rows (N,) of goals (N, m) no other row beats: as small in all, smaller in one."""
    worse = (goals[:, None] >= goals).all(axis=2) & (goals[:, None] > goals).any(axis=2)
    same = (goals[:, None] == goals).all(axis=2) & np.tri(len(goals), k=-1, dtype=np.bool_)
    return ~(worse | same).any(axis=1)


def _exchanged(file: DesignFile, sample: Sample, designs: Any, *, everyone: bool) -> Floats:
    """Return the sample's unit poses with the worst poses of the best designs; everyone: of all on the front."""
    rows = _front(file, designs) or np.argsort(designs.get("CV").ravel(), kind="stable").tolist()
    even = np.unique(np.linspace(0, len(rows) - 1, len(rows) if everyone else min(WATCHED, len(rows))).astype(int))
    vectors = np.array(designs.get("X"), dtype=np.float64)[[rows[k] for k in even]]
    return np.unique(np.concatenate([sample.unit, *(worst_poses(sample, vector) for vector in vectors)]), axis=0)


def _note(file: DesignFile, designs: Any, count: int) -> str:
    """Return how many designs were evaluated, and the best of each objective among those that keep the needs."""
    rows = _front(file, designs)
    if not rows:
        return f"{count:,} designs; none keeps all needs yet"
    values = np.array(designs.get("values"), dtype=np.float64)[rows]
    best: list[str] = []
    for name, sense in file.objectives:
        quantity = QUANTITIES[name]
        column = values[:, list(QUANTITIES).index(name)]
        value = column.min() if sense > 0 else column.max()
        best.append(f"{quantity.key} {quantity.shown(value):.4g}")
    return f"{count:,} designs; {len(rows)} keep all needs; best " + ", ".join(best)
