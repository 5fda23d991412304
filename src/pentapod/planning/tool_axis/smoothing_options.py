"""SmoothingOptions: options of the smoothing of the tool axis."""

from __future__ import annotations

from dataclasses import dataclass, field

from pentapod.planning.tool_axis.cost import CostOptions


@dataclass(frozen=True)
class SmoothingOptions:
    """Options of the sequential convex programming.

    steps, rounds: maximum of programs, and of checks at all waypoints. slack: accepted shortfall of the margin to keep,
    micrometres of a stroke. decrease: relative decrease of the cost below which the iteration stops; after a step that
    was taken it goes on if more than a share `bound` of the coefficients moved as far as they may. cost: of the penalty
    on excess.

    near: margins within this distance of the one to keep enter a program. spare: except those that, to first order,
    stay this much above it within the trust region. rough, fine, finer: accuracies of the first program and of the
    last, and the accuracy in between as a share of the relative decrease of the step before.

    good: ratio of actual to predicted decrease from which the trust region is doubled. most: a step that holds on a
    part of the path is taken as it is if it brings this share of the predicted decrease, else margins are restored
    where it does not hold; tries: how often the part is made smaller. idle: programs in a row after which the iteration
    stops if none of their steps was taken. enough: share of the margin to keep that is enough where given leans come up
    no farther.
    """

    steps: int = 40
    rounds: int = 8
    slack: float = 1e-5
    decrease: float = 2e-3
    bound: float = 0.1
    cost: CostOptions = field(default_factory=CostOptions)
    near: float = 0.15
    spare: float = 0.02
    rough: float = 1e-3
    fine: float = 1e-6
    finer: float = 1e-2
    good: float = 0.25
    most: float = 0.8
    tries: int = 3
    idle: int = 6
    enough: float = 0.5


OPTIONS = SmoothingOptions()
