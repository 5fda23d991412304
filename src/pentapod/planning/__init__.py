"""Planning: where the workpiece stands, how the tool leans, and the smooth leg path that follows."""

from pentapod.planning.leg_path.leg_path import LegPath, LegPiece, leg_path
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.planning.placement.placement import Placement
from pentapod.planning.plan import plan
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.weights import Weights

__all__ = ["LegPath", "LegPiece", "PlacedPath", "Placement", "PlacementConstraints", "Weights", "leg_path", "plan"]
