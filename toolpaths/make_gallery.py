"""Draw the jobs of this folder: `python toolpaths/make_gallery.py [NAME ...]` writes docs/gallery.md and its pictures.

A picture shows the part from in front and above, the cuts in colour from their first to their last, links and rapids
thin. The page tells what each job is for, from the remark at its head, and what its toolpath came to. Then follow five
concave parts of the tests: what a ball leaves on them with contacts on the facets, and with a drive surface.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection, PolyCollection
from scipy.spatial import KDTree

from pentapod.base.arrays import Floats
from pentapod.job import Job
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_mesh
from pentapod.mesh.patch import Patch
from pentapod.toolpath import BallCutter, Mesh, PathReport, RasterOptions, SegmentKind, Toolpath, make_toolpath
from pentapod.toolpath.gouge.gouge import without_gouges
from pentapod.toolpath.gouge.report import GougeOptions, Remedy
from pentapod.toolpath.linking.assembly import assembled
from pentapod.toolpath.strategies.raster import raster_paths
from pentapod.toolpath.surfaces.part_surface import PartSurface

FOLDER = Path(__file__).parent
DOCS = FOLDER.parent / "docs"
sys.path.append(str(FOLDER.parent / "tests"))
import concave_parts  # noqa: E402
from left_material import dense  # noqa: E402

BALL = BallCutter(3e-3)
CONCAVE = {
    "pocket_boss": "A pocket with a square boss in it.",
    "crossing_slots": "Two slots of 8 mm that cross, one deeper than the other.",
    "ribs": "Three ribs. The ball enters one of the gaps, of 10 mm, but not the other, of 5 mm.",
    "stairs": "Five steps, 8 mm wide and 4 mm high.",
    "drafted_pocket": "A round pocket with walls of 75° and a round post with the same draft in its middle.",
}
MOST_LEFT = 0.5e-3
"""From this height on what is left is red, metres."""
ORDER = [
    "dome", "saddle", "wavy", "hatch", "waterline", "offset", "spiral", "polish", "pencil", "deburr", "text", "flower",
    "outline", "seam", "picture", "laser", "burn",
]  # fmt: skip
LIGHT = np.array([-0.4, -0.5, 0.77])
HEAD = """# Gallery

Every strategy at work: each picture is the toolpath of a job in `toolpaths/`, and each of these jobs plans and verifies
as it stands (`pentapod plan toolpaths/NAME.toml -o out/`). Cuts run from blue to yellow in the order of work; links and
rapids are thin and grey. `python toolpaths/make_gallery.py` draws this page.
The notebook `examples/gallery.ipynb` goes from a mesh to a checked program, with pictures after every step.
A sweep of the first of these jobs over tool length and tilt has [a page of its own](sweep.md).
"""

CONCAVE_HEAD = """---

A 6 mm ball on five concave parts, passes 2 mm apart. To the left the contacts lie on the part's facets, and cuts that
gouge are dropped, as they are for toolpaths from files with `[gouge] remedy = ["drop"]`; to the right the ball rolls
over the part: lines are drawn on its drive surface. Red is what is left where the part is not steeper than 80°.
"""


def camera() -> Floats:
    """Return the rotation to a view from in front and above: right, up, towards the eye."""
    turn, rise = np.radians(-25.0), np.radians(50.0)
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    eye = np.array([np.sin(turn) * np.cos(rise) * -1.0, -np.cos(turn) * np.cos(rise), np.sin(rise)])
    eye = eye - (eye @ right) * right
    eye /= np.linalg.norm(eye)
    return np.stack([right, np.cross(eye, right), eye])


def before_and_after(name: str, file: Path) -> str:
    """Draw what a ball leaves on a concave part, red from MOST_LEFT on; return a sentence about it.

    To the left its contacts lie on the part's facets, and cuts that gouge are dropped; to the right its centre runs on
    the drive surface.
    """
    mesh = concave_parts.mesh(name)
    options = RasterOptions(stepover=2e-3)
    surface = PartSurface(mesh, BALL, options.up)
    contacts, _ = assembled("raster", surface, BALL, options, raster_paths(surface, options))
    dropped, _ = without_gouges(contacts, BALL, mesh, GougeOptions((Remedy.DROP,), tolerance=options.chordal))
    view, patch = camera(), Patch.whole(mesh).refined(0.5e-3)
    seen = patch.facet_normals[:, 2] > -1e-6
    patch = Patch(patch.vertices, patch.faces[seen], patch.normals[seen])
    corners = 1e3 * patch.vertices[patch.faces] @ view.T
    order = np.argsort(corners[..., 2].mean(axis=1), kind="stable")
    shade = np.clip(0.35 + 0.6 * np.abs(patch.facet_normals @ (LIGHT / np.linalg.norm(LIGHT))), 0.0, 1.0)
    figure, pair = plt.subplots(1, 2, sharex=True, sharey=True, figsize=(11.0, 4.4), dpi=100)
    shares: list[float] = []
    for axes, toolpath in zip(pair, (dropped, make_toolpath(mesh, BALL, options)), strict=True):
        cuts = [s.tips + BALL.radius * s.axes for s in toolpath.segments if s.kind is SegmentKind.CUT]
        gap = KDTree(np.concatenate([dense(cut, 1e-4) for cut in cuts])).query(patch.vertices[patch.faces].mean(axis=1))
        left = np.asarray(gap[0]) - BALL.radius
        upward = patch.areas * (patch.facet_normals[:, 2] > np.cos(np.radians(80.0)))
        shares.append(float(upward @ (left > MOST_LEFT) / upward.sum()))
        red = np.where(upward > 0.0, np.clip(left / MOST_LEFT, 0.0, 1.0), 0.0)[:, None]
        colours = (np.array([0.93, 0.95, 1.0]) * (1.0 - red) + np.array([0.95, 0.25, 0.2]) * red) * shade[:, None]
        axes.add_collection(
            PolyCollection(corners[order][..., :2], facecolors=colours[order], edgecolors="face", lw=0.2)
        )
        for cut in cuts:
            way = 1e3 * (cut - BALL.radius * np.array([0.0, 0.0, 1.0])) @ view.T
            axes.plot(way[:, 0], way[:, 1], color="0.15", lw=0.4)
        axes.set_aspect("equal")
        axes.autoscale_view()
        axes.axis("off")
    figure.savefig(file, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)
    return (
        f"{1e3 * MOST_LEFT:g} mm or more stays on {shares[0]:.0%} of the surface to the left, on "
        f"{shares[1]:.1%} to the right, with what the ball's shape forbids"
    )


def draw(mesh: Mesh, toolpath: Toolpath, file: Path) -> None:
    """Write the picture of a toolpath on its part."""
    view = camera()
    figure, axes = plt.subplots(figsize=(5.6, 4.2), dpi=100)
    corners = 1e3 * mesh.vertices[mesh.faces] @ view.T
    order = np.argsort(corners[..., 2].mean(axis=1), kind="stable")
    shade = np.clip(0.35 + 0.6 * np.abs(mesh.facet_normals @ (LIGHT / np.linalg.norm(LIGHT))), 0.0, 1.0)
    grey = np.stack([0.93 * shade, 0.95 * shade, shade], axis=1)[order]
    axes.add_collection(PolyCollection(corners[order][..., :2], facecolors=grey, edgecolors=grey, linewidths=0.2))
    cuts = [s for s in toolpath.segments if s.kind is SegmentKind.CUT]
    for segment in toolpath.segments:
        if segment.kind is not SegmentKind.CUT:
            way = 1e3 * segment.tips @ view.T
            axes.plot(way[:, 0], way[:, 1], color="0.45", lw=0.35, zorder=3)
    colours = mpl.colormaps["plasma"](np.linspace(0.0, 0.95, len(cuts)) if len(cuts) > 1 else [0.3])
    strength = np.array([[*colour[:3], 0.25 + 0.75 * cut.power] for colour, cut in zip(colours, cuts, strict=True)])
    if len(cuts) < 4:  # a long line changes its colour on the way
        pieces = [1e3 * cut.tips @ view.T for cut in cuts]
        steps = np.concatenate([np.stack([p[:-1, :2], p[1:, :2]], axis=1) for p in pieces])
        shades = mpl.colormaps["plasma"](np.linspace(0.0, 0.95, len(steps)))
        axes.add_collection(LineCollection(steps, colors=shades, linewidths=0.9, zorder=4))
    else:
        lines = [(1e3 * cut.tips @ view.T)[:, :2] for cut in cuts]
        axes.add_collection(LineCollection(lines, colors=strength, linewidths=0.9, zorder=4))
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")
    figure.savefig(file, bbox_inches="tight", metadata={"Software": None})
    plt.close(figure)


def remark(job: Path) -> str:
    """Return the remark at the head of a job file, as one paragraph."""
    lines = []
    for line in job.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("# "))
    return " ".join(lines).split(" Lengths in mm,")[0]


def said(report: object) -> str:
    """Return the first line of what the strategy came to."""
    parts = getattr(report, "parts", (report,))
    return next(str(part).splitlines()[0] for part in parts if isinstance(part, PathReport))


def sections() -> dict[str, str]:
    """Return the sections of the page as it is, by their names."""
    page = DOCS / "gallery.md"
    parts = page.read_text(encoding="utf-8").split("\n## ")[1:] if page.exists() else []
    rule = "\n---\n"  # what follows it is the head of the next sections
    return {part.split("\n", 1)[0]: f"## {part.split(rule)[0].rstrip()}\n" for part in parts}


def job_section(name: str, pictures: Path) -> str:
    """Draw a job, and return its section of the page."""
    path = FOLDER / f"{name}.toml"
    job = Job.load(path)
    mesh = job_mesh(job)
    toolpath, report = job_toolpath(job, mesh)
    draw(mesh, toolpath, pictures / f"{name}.png")
    told = said(report)
    return f"## {name}\n\n{remark(path)}\n\n![{name}](gallery/{name}.png)\n\n`toolpaths/{name}.toml` · {told}\n"


def concave_section(name: str, pictures: Path) -> str:
    """Draw a concave part before and after, and return its section of the page."""
    told = before_and_after(name, pictures / f"{name}.png")
    title = f"Concave: {name.replace('_', ' ')}"
    return f"## {title}\n\n{CONCAVE[name]} {told}.\n\n![{title}](gallery/{name}.png)\n"


def main(names: list[str]) -> None:
    """Draw what has one of these names, or all, and write the page; the rest of it stays as it is."""
    pictures = DOCS / "gallery"
    pictures.mkdir(parents=True, exist_ok=True)
    page, known = [HEAD], sections()
    for name in ORDER:
        kept = names and name not in names and known.get(name)
        page.append(kept or job_section(name, pictures))
        print(f"{name}: {'kept' if kept else 'drawn'}")
    page.append(CONCAVE_HEAD)
    for name in CONCAVE:
        kept = names and name not in names and known.get(f"Concave: {name.replace('_', ' ')}")
        page.append(kept or concave_section(name, pictures))
        print(f"{name}: {'kept' if kept else 'drawn'}")
    (DOCS / "gallery.md").write_text("\n".join(page), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
