"""Options of proposals."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ProposalOptions:
    """What is proposed. Lengths in mm, angles in degrees.

    usual_mm: largest extents for which the unit mm is believed; else the unit whose part is nearest to the size of the
    work volume is taken. diameters: of cutters; the largest that is not wider than `cutter` of the region's largest
    extent, nor than `narrow` of its shorter side across the direction, is taken; smaller ones, down to a share
    `smaller` of it, where it reaches below most. stepover: as a share of the diameter. steep_deg: slope from which
    surface counts as steep; waterlines where more than `steep` of it is, and less than `flat` of it is too flat for
    them. sideways: by how much more of the surface another side must show than the top; sides are alike from a share of
    `alike`. backs: share of an open surface that may face the top where it is turned over. margin: of a box above and
    below, as a share of the work volume's height. walls_deg, walls: slope from which surface is an upright wall, and
    share of the region from which walls are machined in waterlines beside a raster, whose passes leave those that are
    parallel to them. debris: largest share of an open surface that small bodies are left out with; these are as small
    as a cutter may be. boxes: rows and columns of places for a box where the part is too large; middle: what its middle
    must hold to be taken, as a share of what the best of them holds; points: that stand for the surface then.
    above_foot: share of what the view sees of the region below which a box above the foot is no use, and flatter_deg:
    angles of the region of which the largest is taken then.
    """

    usual_mm: tuple[float, float] = (5.0, 2000.0)
    diameters: tuple[float, ...] = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0)
    cutter: float = 0.1
    narrow: float = 0.4
    smaller: float = 0.3
    stepover: float = 0.5
    feed_mm_min: float = 1500.0
    steep_deg: float = 60.0
    margin: float = 0.001
    steep: float = 0.7
    flat: float = 0.01
    sideways: float = 1.2
    alike: float = 0.99
    backs: float = 0.05
    walls_deg: float = 80.0
    walls: float = 0.001
    debris: float = 0.02
    boxes: int = 9
    middle: float = 0.3
    points: int = 20_000
    above_foot: float = 0.5
    flatter_deg: tuple[float, ...] = (80.0, 70.0, 60.0, 50.0, 40.0, 30.0, 20.0, 10.0)


OPTIONS = ProposalOptions()
