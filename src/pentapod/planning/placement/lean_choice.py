"""Choice of a lean at each waypoint of a stretch of path, among those of a grid, so that the axis turns evenly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.blocks import blocks
from pentapod.planning.placement.sampling import tilted
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.tilt_field import lean


@dataclass(frozen=True)
class ChoiceOptions:
    """What is chosen from, and what counts.

    rings: of the grid of tilts. reach: metres of path before and after a waypoint at which the lean is chosen, too.
    short: cost of a margin below the wanted one, against the mean square of the rate of the axis, 1/m. back: metres of
    path over which the axis goes back to the leans from which it departs. shortest: of a step, metres.
    """

    rings: int = 3
    reach: float = 5e-3
    short: float = 1e5
    back: float = 10e-3
    shortest: float = 1e-5


OPTIONS = ChoiceOptions()


@dataclass(frozen=True, eq=False)
class LeanChoice:
    """Leans to choose from on stretches of a path.

    field (N, 3): leans elsewhere. chosen (n,): waypoints of the stretches. grid (K, n, 3), smallest (K, n): leans there
    and their smallest margins; the first are those of the field. stations (N,): path length at the waypoints, metres.
    """

    problem: PlacementProblem
    field: Floats
    chosen: Ints
    grid: Floats
    smallest: Floats
    stations: Floats
    options: ChoiceOptions

    @classmethod
    def of(
        cls, problem: PlacementProblem, at: Candidate, field: Floats, rows: Ints, stations: Floats,
        options: ChoiceOptions = OPTIONS,
    ) -> LeanChoice:  # fmt: skip
        """Return the choice around waypoints `rows`."""
        ahead = np.searchsorted(stations[rows], stations + options.reach, side="right")
        chosen = np.flatnonzero(np.searchsorted(stations[rows], stations - options.reach) < ahead)
        leans = np.concatenate([field[None, chosen], tilted(problem.samples, chosen, options.rings)])
        smallest = np.empty(leans.shape[:2])
        for part in blocks(len(chosen)):
            rows = chosen[part]
            smallest[:, part] = problem.values_of(at.margins, at.transform, leans[:, part], rows).min(axis=-1)
            inside = problem.samples.inside(lean(problem.samples.nominal[rows], leans[:, part]), rows)
            if inside is not None:
                smallest[:, part][inside < 0.0] = -np.inf
        return cls(problem, field, chosen, leans, smallest, stations, options)

    def leans(self, wanted: Floats) -> Floats:
        """Return leans (N, 3) that have margins of `wanted` (N,) where they may, and turn evenly.

        Dynamic programming over the tilts of the grid.
        """
        chosen, options, nominal = self.chosen, self.options, self.problem.samples.nominal
        axes, there = lean(nominal[chosen], self.grid), lean(nominal, self.field)
        steps = np.maximum(np.diff(self.stations), options.shortest)
        weights = 0.5 * (np.append(steps, 0.0) + np.append(0.0, steps))[chosen] / options.back**2
        alone = options.short * np.clip(wanted[chosen] - self.smallest, 0.0, 1.0)
        alone += weights * np.square(axes - there[chosen]).sum(axis=-1)
        before = np.zeros((len(chosen), len(self.grid)), dtype=np.intp)

        def beside(k: int, side: int) -> Floats | float:
            """Return what the turn from or to the field before or after the k-th chosen waypoint costs."""
            row = int(chosen[k])
            if not 0 <= row + side < len(there):
                return 0.0
            turn = np.square(axes[:, k] - there[row + side]).sum(axis=-1)
            return np.asarray(turn / steps[row + min(side, 0)], dtype=np.float64)

        cost = alone[:, 0] + beside(0, -1)
        for k in range(1, len(chosen)):
            if chosen[k] == chosen[k - 1] + 1:
                turn = np.square(axes[:, k - 1, None] - axes[None, :, k]).sum(axis=-1)
                total = cost[:, None] + turn / steps[chosen[k - 1]]
                before[k] = total.argmin(axis=0)
                cost = total.min(axis=0) + alone[:, k]
            else:
                out = cost + beside(k - 1, 1)
                before[k] = out.argmin()
                cost = out.min() + beside(k, -1) + alone[:, k]
        found, pick = self.field.copy(), int((cost + beside(-1, 1)).argmin())
        for k in range(len(chosen) - 1, -1, -1):
            found[chosen[k]] = self.grid[pick, k]
            pick = int(before[k, pick])
        return found
