"""For researchers: cells, architecture, singularity-free spheres, workspaces. Nothing else imports it."""

from pentapod.theory.architecture import ArchitecturalDistance, architectural_distance
from pentapod.theory.cell_poses import cell_of, poses_in_cell
from pentapod.theory.cells import Cell, CellDecomposition, cell_decomposition
from pentapod.theory.design_distance import DesignDistance, DesignSearch, design_distance
from pentapod.theory.general_sphere import BoundedSphere, SphereSearch, bounded_singularity_free_sphere
from pentapod.theory.guide_choice import GuideChoice, choose_rail_positions, conditioning_criterion, stiffness_criterion
from pentapod.theory.platform_cells import (
    PlatformCell,
    PlatformCells,
    platform_cell_decomposition,
    platform_cell_of,
)
from pentapod.theory.reach import ReachField
from pentapod.theory.rearrangements import EquivalentLeg, LegPencil, cross_ratio
from pentapod.theory.self_motions import SelfMotions, self_motions
from pentapod.theory.sphere import SingularityFreeSphere, singularity_free_sphere
from pentapod.theory.workspace import Workspace

__all__ = [
    "ArchitecturalDistance",
    "BoundedSphere",
    "Cell",
    "CellDecomposition",
    "DesignDistance",
    "DesignSearch",
    "EquivalentLeg",
    "GuideChoice",
    "LegPencil",
    "PlatformCell",
    "PlatformCells",
    "ReachField",
    "SelfMotions",
    "SingularityFreeSphere",
    "SphereSearch",
    "Workspace",
    "architectural_distance",
    "bounded_singularity_free_sphere",
    "cell_decomposition",
    "cell_of",
    "choose_rail_positions",
    "conditioning_criterion",
    "cross_ratio",
    "design_distance",
    "platform_cell_decomposition",
    "platform_cell_of",
    "poses_in_cell",
    "self_motions",
    "singularity_free_sphere",
    "stiffness_criterion",
]
