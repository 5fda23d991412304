"""Simulation: what a machine with real drives, or with masses and forces, makes of a program."""

from pentapod.simulate.contour import contour_errors
from pentapod.simulate.measures import Measure, Tracking
from pentapod.simulate.played import Played
from pentapod.simulate.reference import Reference
from pentapod.simulate.servo import simulate_servo

__all__ = ["Measure", "Played", "Reference", "Tracking", "contour_errors", "simulate_servo"]
