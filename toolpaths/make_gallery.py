"""Draw the jobs of this folder: `python toolpaths/make_gallery.py [JOB ...]` writes docs/gallery.md and its pictures.

A picture shows the part from in front and above, the cuts in colour from their first to their last, links and rapids
thin. The page tells what each job is for, from the remark at its head, and what its toolpath came to.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection, PolyCollection

from pentapod.base.arrays import Floats
from pentapod.job import Job
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_mesh
from pentapod.toolpath import Mesh, PathReport, SegmentKind, Toolpath

FOLDER = Path(__file__).parent
DOCS = FOLDER.parent / "docs"
ORDER = [
    "dome", "saddle", "wavy", "hatch", "waterline", "offset", "spiral", "polish", "pencil", "deburr", "text", "flower",
    "outline", "seam", "picture", "laser", "burn",
]  # fmt: skip
LIGHT = np.array([-0.4, -0.5, 0.77])
HEAD = """# Gallery

Every strategy at work: each picture is the toolpath of a job in `toolpaths/`, and each of these jobs plans and verifies
as it stands (`pentapod plan toolpaths/NAME.toml -o out/`). Cuts run from blue to yellow in the order of work; links and
rapids are thin and grey. `python toolpaths/make_gallery.py` draws this page.
"""


def camera() -> Floats:
    """Return the rotation to a view from in front and above: right, up, towards the eye."""
    turn, rise = np.radians(-25.0), np.radians(50.0)
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    eye = np.array([np.sin(turn) * np.cos(rise) * -1.0, -np.cos(turn) * np.cos(rise), np.sin(rise)])
    eye = eye - (eye @ right) * right
    eye /= np.linalg.norm(eye)
    return np.stack([right, np.cross(eye, right), eye])


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


def main(names: list[str]) -> None:
    """Draw the jobs of some names, or all, and write the page."""
    pictures = DOCS / "gallery"
    pictures.mkdir(parents=True, exist_ok=True)
    page = [HEAD]
    for name in ORDER:
        path = FOLDER / f"{name}.toml"
        job = Job.load(path)
        mesh = job_mesh(job)
        toolpath, report = job_toolpath(job, mesh)
        if not names or name in names:
            draw(mesh, toolpath, pictures / f"{name}.png")
        print(f"{name}: {said(report)}")
        page.append(
            f"## {name}\n\n{remark(path)}\n\n![{name}](gallery/{name}.png)\n\n"
            f"`toolpaths/{name}.toml` · {said(report)}\n"
        )
    (DOCS / "gallery.md").write_text("\n".join(page), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
