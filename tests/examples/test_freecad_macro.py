"""What the FreeCAD macro says where FreeCAD, or pentapod's command, is not there."""

import os
import subprocess
import sys
from pathlib import Path

MACRO = Path(__file__).parents[2] / "examples" / "freecad" / "pentapod_macro.py"


def said(*words, **environment):
    """Run Python, which must fail, and return what it says."""
    whole = {**os.environ, **environment}
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False, env=whole)
    assert done.returncode == 1
    return done.stderr


def test_the_macro_outside_freecad_says_where_it_runs():
    text = said(str(MACRO))
    assert text.startswith("There is no module FreeCAD here. This file is a macro: copy it into the folder")
    assert "Traceback" not in text


def test_a_command_that_is_none_is_named(tmp_path):
    """With empty modules in place of FreeCAD's."""
    for name, content in (("FreeCAD", "GuiUp = False"), ("MeshPart", ""), ("Part", ""), ("Path", "")):
        (tmp_path / f"{name}.py").write_text(content)
    code = f"import runpy; runpy.run_path({str(MACRO)!r}, run_name='macro')['run']('--version')"
    text = said("-c", code, PYTHONPATH=str(tmp_path), PENTAPOD=str(tmp_path / "nowhere"))
    assert "MacroError: pentapod cannot be run as" in text.splitlines()[-1]
    assert "set the environment variable PENTAPOD" in text.splitlines()[-1]
    text = said("-c", code, PYTHONPATH=str(tmp_path), PENTAPOD="", PATH=str(tmp_path))
    assert "MacroError: pentapod is not on the PATH of FreeCAD" in text.splitlines()[-1]
