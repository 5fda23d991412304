"""Planning: the placement of the workpiece, the tool axes, and the smooth leg path."""

from pentapod.planning.leg_path.leg_path import LegPath, LegPiece, leg_path
from pentapod.planning.placement.placed_path import PlacedPath, Placement
from pentapod.planning.plan import plan
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.weights import Weights

__all__ = ["LegPath", "LegPiece", "PlacedPath", "Placement", "PlacementConstraints", "Weights", "leg_path", "plan"]
