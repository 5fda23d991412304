"""The gallery notebook: every cell runs, every step shows a picture, and its program passes."""

import base64
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[2] / "examples" / "gallery.ipynb"
PNG = b"\x89PNG\r\n"


def steps(notebook) -> dict[str, list]:
    """Cells of code below each heading of a step."""
    found: dict[str, list] = {}
    for cell in notebook.cells:
        title = cell.source.splitlines()[0]
        if cell.cell_type == "markdown" and title.startswith("## "):
            found[title] = []
        elif cell.cell_type == "code" and found:
            found[list(found)[-1]].append(cell)
    return found


def test_notebook_is_kept_without_outputs():
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    assert [title[3] for title in steps(notebook)] == list("1234567")
    assert not any(cell.get("outputs") or cell.get("execution_count") for cell in notebook.cells)


@pytest.mark.slow
def test_every_step_shows_a_picture_and_the_program_passes():
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed")
    pytest.importorskip("ipykernel", reason="ipykernel is not installed")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    resources = {"metadata": {"path": str(NOTEBOOK.parent)}}
    nbclient.NotebookClient(notebook, timeout=900, kernel_name="python3", resources=resources).execute()
    for title, cells in steps(notebook).items():
        outputs = [output for cell in cells for output in cell.outputs]
        assert not [o for o in outputs if o.output_type == "error" or o.get("name") == "stderr"], title
        shown = [base64.b64decode(o.data["image/png"]) for o in outputs if "image/png" in o.get("data", {})]
        assert shown, f"{title} shows no picture"
        assert all(picture.startswith(PNG) and len(picture) > 10_000 for picture in shown), title
    said = "".join(output.get("text", "") for output in notebook.cells[-1].outputs).splitlines()
    assert said[0] == "passed"
    assert float(said[1].split()[4]) <= 20.0, said[1]
