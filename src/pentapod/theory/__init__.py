"""For researchers: cells, architecture, singularity-free spheres, workspaces. Nothing else imports it."""

from pentapod.theory.architecture import ArchitecturalDistance, architectural_distance
from pentapod.theory.cell_poses import cell_of, poses_in_cell
from pentapod.theory.cells import Cell, CellDecomposition, cell_decomposition
from pentapod.theory.guide_choice import GuideChoice, choose_rail_positions, conditioning_criterion, stiffness_criterion
from pentapod.theory.reach import ReachField
from pentapod.theory.sphere import SingularityFreeSphere, singularity_free_sphere
from pentapod.theory.workspace import Workspace

__all__ = [
    "ArchitecturalDistance",
    "Cell",
    "CellDecomposition",
    "GuideChoice",
    "ReachField",
    "SingularityFreeSphere",
    "Workspace",
    "architectural_distance",
    "cell_decomposition",
    "cell_of",
    "choose_rail_positions",
    "conditioning_criterion",
    "poses_in_cell",
    "singularity_free_sphere",
    "stiffness_criterion",
]
