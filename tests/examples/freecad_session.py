"""What a user does in FreeCAD, run by freecadcmd: a solid with a round top, a tool, the macro; results as JSON.

The environment names the folder (FOLDER), the macro (MACRO) and how far to go: UNTIL is job, path, or window, which
needs FreeCAD with its window.
"""

import json
import os
import runpy
import sys
from pathlib import Path as File

import FreeCAD as App
import Part
import PathScripts.PathToolBit as ToolBit
import PathScripts.PathToolController as ToolController

sys.path.insert(0, str(File(os.environ["MACRO"]).parent))
import pentapod_macro as macro

folder, until = File(os.environ["FOLDER"]), os.environ["UNTIL"]
document = App.newDocument("part")
ball = Part.makeSphere(100.0, App.Vector(0, 0, -85))
solid = Part.makeBox(60, 40, 30, App.Vector(-30, -20, -15)).common(ball)
part = document.addObject("Part::Feature", "Part")
part.Shape = solid
part.Placement.Base = App.Vector(5, 0, 2)  # in the coordinates of the document
document.recompute()
(top,) = [f"Face{k + 1}" for k, face in enumerate(part.Shape.Faces) if isinstance(face.Surface, Part.Sphere)]
BITS = File(App.getResourceDir()) / "Mod" / "Path" / "Tools" / "Bit"


def controller(bit, feed_mm_min):
    made = ToolBit.Factory.CreateFrom(str(BITS / bit))
    found = ToolController.Create("TC", tool=made, assignViewProvider=App.GuiUp)
    found.HorizFeed = feed_mm_min / 60.0
    return found


tool = controller("6mm_Ball_End.fctb", 1800.0)
result, job = {}, folder / "job.toml"
if until == "window":
    import FreeCADGui as Gui

    document.saveAs(str(folder / "part.FCStd"))
    macro.send(part, [top], tool, macro.folder_of(document))  # then the user changes the job
    job = folder / "part_pentapod" / "job.toml"
    for old, new in json.loads(os.environ["CHANGES"]):
        job.write_text(job.read_text().replace(old, new))
    Gui.Selection.addSelection(part, top)
    Gui.Selection.addSelection(tool)
    runpy.run_path(os.environ["MACRO"], run_name="__main__")
    group = document.getObject("Pentapod")
    result["label"], result["objects"] = group.Label, [o.Name for o in group.Group]
    result["job"] = job.read_text()
    view = Gui.activeDocument().activeView()
    Gui.Selection.clearSelection()
    tool.Tool.ViewObject.Visibility = False
    view.viewIsometric()
    view.fitAll()
    view.saveImage(str(folder / "window.png"), 1000, 700, "White")
elif until == "job":
    result["job"] = macro.send(part, [top], tool, folder).read_text()
    job.write_text(job.read_text().replace("stepover_mm = 1", "stepover_mm = 2.5  # mine"))
    bull = controller("6mm_Bullnose.fctb", 0.0)
    bull.Tool.FlatRadius = 1.0
    document.recompute()
    result["again"] = macro.send(part, [], bull, folder).read_text()
    result["errors"] = []
    for what in ((part, ["Edge1"], tool), (part, [top], None), (part, [top], controller("45degree_chamfer.fctb", 1))):
        try:
            macro.send(*what, folder)
        except macro.MacroError as error:
            result["errors"].append(str(error))
else:
    macro.send(part, [top], tool, folder)
    for old, new in json.loads(os.environ["CHANGES"]):
        assert old in job.read_text(), old
        job.write_text(job.read_text().replace(old, new))
    for _ in range(2):  # the second time replaces what is shown
        group = macro.show(macro.plan(job), job, document)
    path, axes = group.Group
    moves = [command.Parameters for command in path.Path.Commands]
    result["label"] = group.Label
    result["kinds"] = [command.Name for command in path.Path.Commands]
    result["tips"] = [[move["X"], move["Y"], move["Z"]] for move in moves]
    result["objects"] = [o.Name for o in document.Objects if o.Name.startswith("Pentapod")]
    # The ball touches the face: its centre, on the drawn axis, is as far from it as its radius.
    face = part.Shape.getElement(top)
    ends = [[App.Vector(v.Point) for v in edge.Vertexes] for edge in axes.Shape.Edges]
    result["axes"] = [[list(low), list(high)] for low, high in ends]
    centres = [low + (high - low).normalize() * 3.0 for low, high in ends]
    result["distances"] = [face.distToShape(Part.Vertex(centre))[0] for centre in centres]
    try:
        job.write_text(job.read_text().replace("cut_mm_min", "cut_mm_mn"))
        macro.plan(job)
    except macro.MacroError as error:
        result["error"] = str(error)
(folder / "result.json").write_text(json.dumps(result))
if App.GuiUp:
    os._exit(0)  # it would ask whether to save the document
