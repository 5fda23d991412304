"""FreeCAD macro: sends selected faces and a tool to a pentapod job, plans it, and shows the program's path.

Select faces of a solid (or a whole solid, or a mesh) and a tool bit or tool controller, then run the macro. Beside the
document it makes a folder with part.stl, job.toml and the run; docs/howto/freecad.md says more. FreeCAD has a Python of
its own, so pentapod runs as a command: the one that the environment variable PENTAPOD names, or the first on the PATH.
"""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
import tempfile
import threading
from pathlib import Path

try:
    import FreeCAD as App
    import MeshPart
    import numpy as np
    import Part
    import Path as Cam
except ModuleNotFoundError as error:
    raise SystemExit(
        f"There is no module {error.name} here. This file is a macro: copy it into the folder of FreeCAD's user macros "
        "and run it there (Macro > Macros...). Without FreeCAD use `pentapod new PART.step`, then `pentapod plan`."
    ) from error

if App.GuiUp:
    import FreeCADGui as Gui
    from PySide import QtGui

DEFLECTION_MM = 0.005  # of the facets from the solid
MARGIN_MM = 0.1  # of the region's box about the selected faces
MARGIN_DEG = 1.0  # of the region's angle about their normals
MOST_POINTS = 20_000  # of the path that is shown; the program has a row for each setpoint
AXES, AXIS_MM = 200, 15.0  # tool axes that are drawn, and their length
AXIS_COLOUR = (0.95, 0.6, 0.2)
RAPID = 1.2  # what is faster than the job's feed by this factor is shown as a rapid
SHAPES = {"ballend": "ball", "endmill": "flat", "bullnose": "bull"}

FIRST_JOB = """\
{part}
[machine]
name = "desk"

{tool}
[toolpath]
stepover_mm = {stepover:g}

{axis}
[feed]
cut_mm_min = {feed:g}

[tolerance]
chordal_mm = 0.01
path_mm = 0.02
axis_deg = 0.5

[placement]
mode = "free"
"""


class MacroError(Exception):
    """What the user has to mend, or why pentapod refused."""


def send(obj, faces, tool, folder):
    """Write part.stl and job.toml into a folder and return the job file.

    obj: a solid or a mesh; faces: names such as "Face6", none for the whole; tool: a tool bit or tool controller. Of a
    job that is there, only the tables [part] and [tool] are written anew, and [axis] where the tool is of another type:
    the others are the user's.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    mesh = obj.Mesh.copy() if obj.isDerivedFrom("Mesh::Feature") else _facets(Part.getShape(obj))
    if mesh.CountFacets == 0:
        raise MacroError(f"{obj.Label} has no surface")
    mesh.write(str(folder / "part.stl"))
    part = {"mesh": "part.stl", "unit": "mm", **_region(obj, faces)}
    cutter, feed = _cutter(tool)
    axis = {"tilt_deg": 15.0 if cutter["type"] == "ball" else 0.0}  # other ends would gouge
    tables = {"part": _table("part", part), "tool": _table("tool", cutter), "axis": _table("axis", axis)}
    job = folder / "job.toml"
    if job.exists():
        text = job.read_text(encoding="utf-8")
        if f'type = "{cutter["type"]}"' in text:
            del tables["axis"]
        text = _replaced(text, tables)
    else:
        stepover = round(cutter["diameter_mm"] / 6.0, 3)
        text = FIRST_JOB.format(**tables, stepover=stepover, feed=feed or 1500.0)
    job.write_text(text, encoding="utf-8")
    return job


def plan(job, said=print):
    """Plan a job into the folder `out` beside it and return that folder. Raises MacroError where pentapod refuses."""
    out = job.parent / "out"
    run("plan", job, "-o", out, said=said)
    return out


def show(out, job, document):
    """Show a run's program in a document: the path of the tip and tool axes, in a group; return the group.

    The path is computed from the leg lengths of the program, not from the toolpath that was planned.
    """
    rows = run("fk", "--program", out / "program.csv", "--job", job)
    table = np.loadtxt(rows.splitlines()[1:], delimiter=",", ndmin=2)
    times, tips, axes = table[:, 0], table[:, 1:4], table[:, 4:7]
    kept = np.unique(np.append(np.arange(0, len(table), -(-len(table) // MOST_POINTS)), len(table) - 1))
    lengths = np.linalg.norm(np.diff(tips[kept], axis=0), axis=1)
    speeds = np.append(np.inf, lengths / np.diff(times[kept]))  # to the first point it is brought, as by a rapid
    cut = float(re.search(r"^\s*cut_mm_min\s*=\s*([0-9.]+)", job.read_text(encoding="utf-8"), re.M)[1]) / 60.0
    commands = [
        Cam.Command("G0" if speed > RAPID * cut else "G1", _words(x, y, z, speed))
        for (x, y, z), speed in zip(tips[kept].tolist(), speeds.tolist(), strict=True)
    ]
    group = document.getObject("Pentapod") or document.addObject("App::DocumentObjectGroup", "Pentapod")
    for old in list(group.Group):
        document.removeObject(old.Name)
    path = document.addObject("Path::Feature", "PentapodPath")
    path.Path = Cam.Path(commands)
    drawn = document.addObject("Part::Feature", "PentapodAxes")
    where = np.linspace(0, len(table) - 1, min(AXES, len(table))).astype(int)
    ends = np.stack([tips[where], tips[where] + AXIS_MM * axes[where]], axis=1).tolist()
    drawn.Shape = Part.makeCompound([Part.makeLine(tuple(low), tuple(high)) for low, high in ends])
    group.addObjects([path, drawn])
    if App.GuiUp:
        path.ViewObject.StartPosition = App.Vector(*tips[0].tolist())  # not the origin
        path.ViewObject.LineWidth, drawn.ViewObject.LineWidth = 2, 1
        drawn.ViewObject.LineColor = drawn.ViewObject.PointColor = AXIS_COLOUR
        drawn.ViewObject.PointSize = 1
    passed = json.loads((out / "verdict.json").read_text(encoding="utf-8"))["passed"]
    group.Label = f"pentapod: {times[-1]:.1f} s, verdict {'passed' if passed else 'NOT passed'}"
    document.recompute()
    return group


def _words(x, y, z, speed):
    """Return the words of a move: millimetres, and mm/s where the speed is finite."""
    words = {"X": x, "Y": y, "Z": z}
    return {**words, "F": speed} if math.isfinite(speed) else words


def run(*words, said=None):
    """Run pentapod and return what it prints; said: is told each line of progress. Raises MacroError."""
    command = os.environ.get("PENTAPOD") or shutil.which("pentapod")
    if command is None or not os.access(command, os.X_OK):
        where = "is not on the PATH of FreeCAD" if command is None else f"cannot be run as {command}"
        raise MacroError(
            f"pentapod {where}: set the environment variable PENTAPOD to its command, and start FreeCAD anew"
        )
    # The Python of FreeCAD is not that of pentapod.
    own = {name: value for name, value in os.environ.items() if name != "PYTHONHOME"}
    given = [command, *map(str, words)]
    with subprocess.Popen(given, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=own) as running:
        printed, lines = [], []
        reader = threading.Thread(target=lambda: printed.append(running.stdout.read()))
        reader.start()
        for line in running.stderr:
            lines.append(line.rstrip())
            if said is not None:
                said(lines[-1])
            if App.GuiUp:
                Gui.updateGui()
        reader.join()
    if running.returncode != 0:
        raise MacroError("\n".join([*lines[-12:], *printed]).strip() or f"pentapod ended with {running.returncode}")
    return printed[0]


def _facets(shape):
    """Return the mesh of a shape, in the coordinates of the document."""
    return MeshPart.meshFromShape(Shape=shape, LinearDeflection=DEFLECTION_MM, AngularDeflection=math.radians(5.0))


def _region(obj, faces):
    """Return the keys of [part] for the selected faces: a box about them, and the cone of their normals."""
    if not faces:
        return {}
    if obj.isDerivedFrom("Mesh::Feature"):
        raise MacroError("of a mesh only the whole can be sent: select the object, not its faces")
    chosen = [Part.getShape(obj, name, needSubElement=True) for name in faces]
    if any(face.ShapeType != "Face" for face in chosen):
        raise MacroError("select faces, not edges or vertices")
    normals, box = [], App.BoundBox()
    for face in chosen:
        box.add(face.optimalBoundingBox(False) if hasattr(face, "optimalBoundingBox") else face.BoundBox)
        facets = [[np.array(p) for p in facet.Points] for facet in _facets(face).Facets]
        normals += [np.cross(b - a, c - a) for a, b, c in facets]
    normals = np.array(normals)
    mean = normals.sum(axis=0)
    if np.linalg.norm(mean) < 1e-6 * np.linalg.norm(normals, axis=1).sum():
        raise MacroError("the faces look in all directions: select those of one side")
    mean /= np.linalg.norm(mean)
    size = np.linalg.norm(normals, axis=1)
    units = normals[size > 0.0] / size[size > 0.0, None]
    widest = math.degrees(math.acos(float(np.clip((units @ mean).min(), -1.0, 1.0))))
    low, high = ([round(v, 4) for v in corner] for corner in _corners(box))
    return {
        "region_box_mm": [low, high],
        "region_direction": [round(v, 6) + 0.0 for v in mean.tolist()],
        "region_angle_deg": round(min(widest + MARGIN_DEG, 180.0), 2),
    }


def _corners(box):
    low = (box.XMin - MARGIN_MM, box.YMin - MARGIN_MM, box.ZMin - MARGIN_MM)
    return low, (box.XMax + MARGIN_MM, box.YMax + MARGIN_MM, box.ZMax + MARGIN_MM)


def _cutter(tool):
    """Return the keys of [tool], and the feed in mm/min of a tool controller, 0 where there is none."""
    if tool is None:
        raise MacroError("select a tool bit or a tool controller too")
    feed = 60.0 * float(tool.HorizFeed.Value) if hasattr(tool, "HorizFeed") else 0.0
    bit = getattr(tool, "Tool", tool)
    shape = Path(str(getattr(bit, "BitShape", getattr(bit, "ShapeID", "")))).stem
    if shape not in SHAPES:
        raise MacroError(f"{bit.Label} is not a ball, flat or bull-nose end, but {shape or 'no tool'}")
    keys = {"type": SHAPES[shape], "diameter_mm": round(float(bit.Diameter.Value), 6)}
    if SHAPES[shape] == "bull":  # FreeCAD before 1.1 has the radius of the flat part below
        corner = getattr(bit, "CornerRadius", None)
        radius = 0.5 * keys["diameter_mm"] - bit.FlatRadius.Value if corner is None else corner.Value
        keys["corner_mm"] = round(radius, 6)
    return keys, feed


def _table(name, keys):
    """Return a table of TOML; JSON writes texts, numbers and lists alike."""
    return "\n".join([f"[{name}]", *(f"{key} = {json.dumps(value)}" for key, value in keys.items())]) + "\n"


def _replaced(text, tables):
    """Return a job file with some tables replaced, and the rest as it was."""
    pieces = re.split(r"^(?=\[)", text, flags=re.M)
    named = {re.match(r"\[([^\]]+)\]", piece)[1]: k for k, piece in enumerate(pieces) if piece.startswith("[")}
    for name, table in tables.items():
        if name not in named:
            pieces.append("\n" + table)
        else:
            pieces[named[name]] = table + "\n"
    return "".join(pieces)


def selected():
    """Return the selected object, the names of its faces, and the selected tool, or the only one of the document."""
    parts, tools = [], []
    for item in Gui.Selection.getSelectionEx():
        (tools if _is_tool(item.Object) else parts).append(item)
    if len(parts) != 1:
        raise MacroError("select faces of one object, or one object, and a tool")
    if not tools:
        every = [o for o in App.ActiveDocument.Objects if _is_tool(o) and hasattr(o, "Tool")]
        return parts[0].Object, list(parts[0].SubElementNames), every[0] if len(every) == 1 else None
    return parts[0].Object, list(parts[0].SubElementNames), tools[0].Object


def _is_tool(obj):
    return hasattr(obj, "BitShape") or hasattr(obj, "ShapeID") or hasattr(obj, "Tool")


def folder_of(document):
    """Return the folder for a document's job: beside its file, or a new one where it has not been saved."""
    if not document.FileName:
        return Path(tempfile.mkdtemp(prefix="pentapod-"))
    file = Path(document.FileName)
    return file.with_name(f"{file.stem}_pentapod")


def main():
    """Send what is selected, plan it, and show the program; what goes wrong is said in a window."""

    def said(line):
        App.Console.PrintMessage(line + "\n")

    try:
        obj, faces, tool = selected()
        job = send(obj, faces, tool, folder_of(App.ActiveDocument))
        said(f"pentapod: {job}")
        group = show(plan(job, said), job, App.ActiveDocument)
        said(group.Label)
    except MacroError as error:
        App.Console.PrintError(f"{error}\n")
        QtGui.QMessageBox.warning(None, "pentapod", str(error))


if __name__ == "__main__":  # so FreeCAD runs macros
    main()
