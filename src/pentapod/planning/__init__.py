"""Planning: where the workpiece stands, how the tool leans, and the smooth leg path that follows."""

from pentapod.planning.freedom import Freedom
from pentapod.planning.leg_path import LegPath, LegPiece, leg_path
from pentapod.planning.placed_path import PlacedPath
from pentapod.planning.placement import Placement
from pentapod.planning.plan import plan
from pentapod.planning.weights import Weights

__all__ = ["Freedom", "LegPath", "LegPiece", "PlacedPath", "Placement", "Weights", "leg_path", "plan"]
