"""The plots of a program against time: lengths, rates, accelerations, jerks and forces of its legs, speed, margins."""

from __future__ import annotations

from typing import Any

import numpy as np

from pentapod.machine.dynamics.deflection import Yielding, leg_pushes
from pentapod.machine.machine import Machine
from pentapod.report.drawings.colours import LIMIT_COLOUR, QUIET_COLOUR, leg_colour
from pentapod.report.figure import DETAIL
from pentapod.report.pack import Packed
from pentapod.report.series import Curve, Row, bucket_edges, bucket_places, extremes, packed_rows
from pentapod.report.signals import Signals
from pentapod.verify.replay.row_forces import RowForces

SPEED_COLOUR = "#296cb8"


def plots_of(packed: Packed, signals: Signals, machine: Machine, *, compensated: bool) -> dict[str, Any]:
    """Add the arrays of the plots to the page's and return the rest.

    compensated: whether drives make good what the legs yield to weight.
    """
    limits, times, buckets = machine.legs, signals.times, DETAIL.buckets
    legs = [Curve(f"leg {k + 1}", leg_colour(k)) for k in range(signals.legs.shape[1])]
    period = float(times[-1]) / max(len(times) - 1, 1)
    jerks = np.diff(signals.accelerations, axis=0, append=signals.accelerations[-1:]) / period
    by_leg = (
        ("leg lengths, mm", signals.legs, limits.min_length, limits.max_length),
        ("leg rates, mm/s", signals.rates, -limits.max_velocity, limits.max_velocity),
        ("leg accelerations, mm/s²", signals.accelerations, -limits.max_acceleration, limits.max_acceleration),
        ("leg jerks, mm/s³", jerks, -limits.max_jerk, limits.max_jerk),
    )
    rows = [
        Row(title, extremes(1e3 * values, buckets), legs, np.unique([1e3 * low, 1e3 * high]).tolist(), grouped=True)
        for title, values, low, high in by_leg
    ]
    poses = signals.tips + machine.tool_length * signals.axes, -signals.axes
    if machine.drive_forces.limited:
        peak = machine.drive_forces.peak_force
        push = RowForces.at(machine, poses, signals.rates, signals.accelerations, signals.cutting).push
        ends = np.unique([-peak, peak]).tolist()
        rows.append(Row("leg forces, N", extremes(push, buckets), legs, ends, grouped=True))
    if machine.stiffness.given and machine.ends_on_line:
        push = leg_pushes(machine, *poses, signals.rates, signals.accelerations, weight=not compensated)
        found = Yielding.of(machine, *poses, push)
        alone = 1e6 * np.linalg.norm(found.shift, axis=1)
        cut = alone + 1e6 * machine.cutting_force * found.softest * signals.cutting
        kinds = [Curve("with the cutting force", LIMIT_COLOUR, (6, 4)), Curve("by masses", SPEED_COLOUR)]
        rows.append(Row("deflection of the tip, µm", extremes(np.column_stack([cut, alone]), buckets), kinds, low=0.0))
    speeds = 6e4 * np.stack([signals.speeds, signals.speed_limits], axis=1)
    moves = [Curve("as it moves", SPEED_COLOUR), Curve("feed or rapid rate", LIMIT_COLOUR, (6, 4))]
    rows.append(Row("speed, mm/min", extremes(speeds, buckets), moves, low=0.0))
    order = np.argsort(signals.margins.min(axis=0), kind="stable")[: DETAIL.margin_curves - 1]
    margins = np.column_stack([signals.smallest_margins, signals.margins[:, order]])
    between = np.column_stack([np.interp(times, times[signals.margin_rows], column) for column in margins.T])
    names = [
        Curve("smallest", QUIET_COLOUR),
        *(Curve(signals.margin_names[k], leg_colour(n)) for n, k in enumerate(order)),
    ]
    rows.append(Row("margins, 0 at a limit", extremes(between, buckets), names, [0.0]))
    return packed_rows(packed, bucket_places(times, buckets), rows, "time, s", " s")


def bucket_words(signals: Signals) -> str:
    """Return how exact the plots are."""
    seconds = float(signals.times[-1]) / (len(bucket_edges(len(signals.times), DETAIL.buckets)) - 1)
    return f"Of every {1e3 * seconds:.3g} ms the lowest and the highest value are drawn; program.csv has each row."
