"""The pentapods that the kinematic tests run on."""

from pentapods import conic_determinant, leg_determinant, paper, pentapod, random_poses

__all__ = ["conic_determinant", "leg_determinant", "paper", "pentapod", "random_poses"]
