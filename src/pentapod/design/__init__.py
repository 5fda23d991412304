"""Machine design: searches for geometries, proofs of what they keep, and their machine files."""

from pentapod.design.design_file import DesignFile
from pentapod.design.members import Front, Member, design_machines

__all__ = ["DesignFile", "Front", "Member", "design_machines"]
