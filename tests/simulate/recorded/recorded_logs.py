"""Logs of runs whose errors are known, made from programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pentapod.program import Program
from pentapod.program.posts.motion import lengths_at
from pentapod.simulate.recorded.run_log import RunLog

NAMES = tuple(f"leg{k + 1}_mm" for k in range(5))


def log_of(times, legs, commands=None, forces=None) -> RunLog:
    return RunLog(Path("log.csv"), times, legs, commands, forces, range(2, len(times) + 2))


def write_log(path, times, legs, **more):
    """A CSV of lengths in mm; more: columns by the beginning of their titles."""
    names, columns = ["time_s", *NAMES], [times, 1e3 * legs]
    for kind, values in more.items():
        names += [f"{kind}{k + 1}_{'n' if kind == 'force' else 'mm'}" for k in range(5)]
        columns.append(values if kind == "force" else 1e3 * values)
    np.savetxt(path, np.column_stack(columns), "%.7f", ",", header=",".join(names), comments="")
    return str(path)


def paced(program: Program, changes, seconds):
    """Times of a log each millisecond, and the program's time there: pace from each second on, changed in 0.1 s."""
    times = np.arange(round(1e3 * seconds)) * 1e-3
    pace = np.ones(len(times))
    for second, value in changes:
        pace[times >= second] = value
    smooth = np.convolve(np.pad(pace, 50, mode="edge"), np.ones(101) / 101, "valid")[: len(times)]
    return times, np.clip(np.concatenate([[0.0], np.cumsum(smooth[:-1])]) * 1e-3, 0.0, program.duration)


def with_errors(program: Program, due, *, offset=0.0, scale=0.0, drift=0.0, lag=0.0):
    """Legs at the program's times `due`, each with its errors (SI); drift with the seconds of the log."""
    lags = np.broadcast_to(lag, 5)
    legs = np.column_stack([lengths_at(program, np.maximum(due - lags[k], 0.0))[:, k] for k in range(5)])
    return legs + offset + scale * (legs - legs.mean(axis=0)) + np.outer(np.arange(len(due)) * 1e-3, np.ones(5)) * drift
