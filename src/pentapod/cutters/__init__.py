"""Cutters, beams and sprays: contact, tip and body; a file for each."""

from pentapod.cutters.ball import BallCutter
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.cutters.lollipop import Lollipop
from pentapod.cutters.registry import CUTTERS
from pentapod.cutters.stand_off import StandOff
from pentapod.cutters.tool import Tool

__all__ = ["CUTTERS", "BallCutter", "BullNose", "FlatEnd", "Lollipop", "StandOff", "Tool"]
