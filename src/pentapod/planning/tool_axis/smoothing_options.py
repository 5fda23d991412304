"""SmoothingOptions: options of the smoothing of the tool axis."""

from __future__ import annotations

from dataclasses import dataclass, field

from pentapod.planning.tool_axis.cost import CostOptions


@dataclass(frozen=True)
class SmoothingOptions:
    """Options of the sequential convex programming.

    steps, rounds: maximum of programs, and of checks at all waypoints. slack: accepted shortfall of the margin to keep,
    micrometres of a stroke. decrease: relative decrease of the cost below which the iteration stops. cost: of the
    penalty on excess.

    near: margins within this distance of the one to keep enter a program. spare: except those that, to first order,
    stay this much above it within the trust region. ask: share of what the trust region allows that a program asks at
    most of margins that are short. bearable: by how much one may stay short at the price of the present cost, where not
    all can come up. rough, fine, finer: accuracies of the first program and of the last, and the accuracy in between as
    a share of the relative decrease of the step before.

    shortfall, saving: a step whose margin is short by less than `shortfall` is accepted if it saves the share `saving`
    of the cost; the next step restores the margin. less: so is one whose largest shortfall does not grow, if the sum of
    all shortfalls falls to this share. good: ratio of actual to predicted decrease from which the trust region is
    doubled; next_radius: the least of it, as a share of the cone, for another margin to keep. most: a step that holds
    on a part of the path is taken at once if it brings this share of the predicted decrease; tries: how often that part
    is made smaller. back: programs after the last step that restore the margin. idle: programs in a row after which the
    iteration stops if none of their steps was taken.

    levels: steps in which given leans come up to the margin to keep; enough: share of it that is enough where they come
    up no farther; far: all waypoints within this distance of it are active then.
    """

    steps: int = 40
    rounds: int = 8
    slack: float = 1e-5
    decrease: float = 2e-3
    cost: CostOptions = field(default_factory=CostOptions)
    near: float = 0.15
    spare: float = 0.02
    ask: float = 0.5
    bearable: float = 0.1
    rough: float = 1e-3
    fine: float = 1e-6
    finer: float = 1e-2
    shortfall: float = 1e-2
    saving: float = 0.1
    less: float = 0.9
    good: float = 0.25
    next_radius: float = 0.5
    most: float = 0.5
    tries: int = 3
    back: int = 8
    idle: int = 10
    levels: int = 4
    enough: float = 0.5
    far: float = 0.3


OPTIONS = SmoothingOptions()
