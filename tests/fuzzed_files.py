"""Files of every kind that is read: valid ones, and the same with faults drawn from a seed; as a script it reads them.

python fuzzed_files.py SEED COUNT [NAME …]      prints one line for each input that a reader did not answer well
"""

# ruff: noqa: B008, E501, T201 - readers by name, and lines for whoever started the script

from __future__ import annotations

import io
import re
import resource
import signal
import sys
import tempfile
import traceback
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

STEP = Path(__file__).parent / "mesh" / "io" / "plate_with_ball.step"
MOST_SECONDS, MOST_BYTES = 10, 8_000_000_000


def _stl():
    from pentapod.cli.commands.new import dome_stl

    return dome_stl(cells=4)


def _grid():
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    points = np.c_[x.ravel(), y.ravel(), 0.1 * (x * y).ravel()]
    k = np.array([4 * j + i for j in range(3) for i in range(3)])
    return points, np.concatenate([np.c_[k, k + 1, k + 5], np.c_[k, k + 5, k + 4]])


def _ascii_stl():
    points, faces = _grid()
    text = "solid a\n"
    for face in faces:
        corners = "".join("      vertex {:.6g} {:.6g} {:.6g}\n".format(*points[k]) for k in face)
        text += f"  facet normal 0 0 1\n    outer loop\n{corners}    endloop\n  endfacet\n"
    return (text + "endsolid a\n").encode()


def _ply(binary):
    points, faces = _grid()
    form = "binary_little_endian" if binary else "ascii"
    head = (
        f"ply\nformat {form} 1.0\ncomment a\nelement vertex {len(points)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if binary:
        rows = b"".join(b"\3" + face.astype("<i4").tobytes() for face in faces)
        return head + points.astype("<f4").tobytes() + rows
    rows = ["{:.6g} {:.6g} {:.6g}".format(*p) for p in points] + ["3 {} {} {}".format(*f) for f in faces]
    return head + ("\n".join(rows) + "\n").encode()


def _obj():
    points, faces = _grid()
    lines = ["# a", "o a"] + ["v {:.6g} {:.6g} {:.6g}".format(*p) for p in points]
    return ("\n".join([*lines, *("f {}//1 {} {}/1".format(*(f + 1)) for f in faces)]) + "\n").encode()


def _threemf():
    points, faces = _grid()
    text = '<?xml version="1.0"?><model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
    text += '<resources><object id="1"><mesh>\n<vertices>'
    text += "".join('<vertex x="{:.6g}" y="{:.6g}" z="{:.6g}"/>\n'.format(*p) for p in points)
    text += "</vertices><triangles>" + "".join('<triangle v1="{}" v2="{}" v3="{}"/>\n'.format(*f) for f in faces)
    text += '</triangles></mesh></object><object id="2"><components><component objectid="1"/></components></object>'
    return (text + '</resources><build><item objectid="2"/></build></model>').encode()


def _packed_threemf(text):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("3D/3dmodel.model", text)
    return packed.getvalue()


def _glb():
    import trimesh

    return trimesh.Trimesh(*_grid(), process=False).export(file_type="glb")


def _load_model(folder):
    """Load the archive of a spoiled model: spoiled archives seldom get so far."""
    from pentapod.toolpath import load_mesh

    (folder / "a.3mf").write_bytes(_packed_threemf((folder / "3dmodel.model").read_bytes()))
    return load_mesh(folder / "a.3mf")


def _dxf():
    import ezdxf

    document = ezdxf.new("R2000")
    document.header["$INSUNITS"] = 4
    model = document.modelspace()
    model.add_circle((10, 5), 4)
    model.add_arc((1, 5), 4, 10, 70)
    model.add_line((0, 0), (3, 4))
    model.add_polyline2d([(0, 0), (20, 0, 1), (20, 10)], format="xyb")
    text = io.StringIO()
    document.write(text)
    return text.getvalue().encode()


def _spline_dxf():
    import ezdxf

    document = ezdxf.new("R2000")
    document.header["$INSUNITS"] = 4
    model = document.modelspace()
    model.add_spline([(0, 0), (5, 5), (10, 0), (15, 5)])
    model.add_ellipse((3, 3), (5, 0), 0.4, 0.3, 4.0)
    model.add_lwpolyline([(0, 0), (20, 0, 0, 0, 1), (20, 10)], format="xyseb")
    text = io.StringIO()
    document.write(text)
    return text.getvalue().encode()


_ROTARY = {
    "table_table_no_tcp.nc": ["table C", "table A"],
    "head_head_no_tcp.nc": ["head C", "head A"],
    "head_table_no_tcp.nc": ["table C", "head B"],
    "linuxcnc_dual_table.ngc": ["table A", "table B"],
    "indexed_a.nc": ["table A"],
}
"""The rotary axes that files of CAM systems need, by name."""

_SVG = b"""<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="50mm" viewBox="0 0 100 50">
<style>.a{display:none} #b{transform:rotate(3)}</style><g id="g" transform="translate(2,3) rotate(4)">
<path d="M 1 2 L 3 4 C 5 6 7 8 9 1 S 3 4 5 6 Q 1 2 3 4 T 5 6 A 3 4 10 0 1 20 20 Z"/><circle cx="9" cy="8" r="7"/>
<rect x="1" y="2" width="9" height="8" rx="2"/><polyline points="1,2 3,4 5,6"/></g><use href="#g" x="5" y="6"/></svg>
"""


def _picture(form):
    from PIL import Image

    rng, packed = np.random.default_rng(0), io.BytesIO()
    Image.fromarray(rng.integers(0, 255, (9, 11), dtype=np.uint8)).save(packed, form)
    return packed.getvalue()


def _toolpath(suffix, name=None):
    from pentapod.toolpath import Segment, SegmentKind, Toolpath
    from pentapod.toolpath.formats import format_of

    tips = np.c_[np.arange(9.0), np.sin(np.arange(9.0)), np.zeros(9)] * 1e-3
    axes = np.tile([0.0, 0.6, 0.8], (9, 1))
    segments = (
        Segment(SegmentKind.RAPID, tips[:3], axes[:3], np.inf),
        Segment(SegmentKind.CUT, tips[2:6], axes[2:6], 0.02, 0.5, 1.5),
        Segment(SegmentKind.LINK, tips[5:], axes[5:], 0.03),
    )
    return format_of("a" + suffix, name).write(Toolpath(segments, 1e-3))


def _post(name):
    from pentapod.geometry.rigid import RigidTransform
    from pentapod.kinematics.component import COMPONENTS
    from pentapod.program import Program, Provenance
    from pentapod.program.posts import PostInput, find_post

    legs = np.round(0.4 + 0.001 * np.random.default_rng(0).random((9, 5)), 9)
    source = Provenance("desk", "0" * 16, "1" * 16, "0.1.0")
    program = Program(1e-3, legs, "cubic", COMPONENTS[0], RigidTransform(np.eye(3), np.zeros(3)), source)
    return find_post(name).write(PostInput(program))


def readers():
    """Return by name: how a folder of files is read, and the files, the first of which gets the faults."""
    from pentapod.job import Job
    from pentapod.machine.machine import load_machine
    from pentapod.program import read_csv
    from pentapod.program.posts import read_post
    from pentapod.toolpath import load_mesh, read_darkness, read_lines, read_points
    from pentapod.toolpath.formats import read_toolpath
    from pentapod.toolpath.formats.rotary import RotaryAxes
    from usual_job import job_text

    library = Path(sys.modules["pentapod.machine"].__path__[0]) / "library" / "desk.toml"
    found = {}
    for name, data in {
        "a.stl": _stl(), "b.stl": _ascii_stl(), "a.ply": _ply(binary=True), "b.ply": _ply(binary=False), "a.obj": _obj(),
    }.items():  # fmt: skip
        found[name] = (lambda folder, n=name: load_mesh(folder / n, "mm"), {name: data})
    found["a.3mf"] = (lambda folder: load_mesh(folder / "a.3mf"), {"a.3mf": _packed_threemf(_threemf())})
    found["3dmodel.model"] = (_load_model, {"3dmodel.model": _threemf()})
    found["a.glb"] = (lambda folder: load_mesh(folder / "a.glb"), {"a.glb": _glb()})
    if find_spec("OCP") is not None:  # of the extra step
        found["a.step"] = (lambda folder: load_mesh(folder / "a.step", chordal=1e-4), {"a.step": STEP.read_bytes()})
    for name, data in {"a.svg": _SVG, "a.dxf": _dxf(), "b.dxf": _spline_dxf()}.items():
        found[name] = (lambda folder, n=name: read_lines(folder / n, 1e-5), {name: data})
    for name, form in {"a.png": "PNG", "a.jpg": "JPEG", "a.gif": "GIF", "a.tif": "TIFF", "a.pgm": "PPM"}.items():
        found[name] = (lambda folder, n=name: read_darkness(folder / n), {name: _picture(form)})
    points = b"# points = 4\nline,x_mm,y_mm,z_mm\na,1,2,3\na,2.5,2e0,3\nb,0,0,0\nb,1,1,-1\n"
    found["points.csv"] = (lambda folder: read_points(folder / "points.csv"), {"points.csv": points})
    for suffix in (".csv", ".npz", ".apt", ".ngc", ".nc", ".mpf", ".robodk.csv"):
        name = "path" + suffix
        found[name] = (lambda folder, n=name: read_toolpath(folder / n, feed=0.01), {name: _toolpath(suffix)})
    for path in sorted((Path(__file__).parent / "toolpath" / "formats" / "cam").iterdir()):
        if not path.name.startswith("refused"):
            rotary = _ROTARY.get(path.name)
            axes = None if rotary is None else RotaryAxes.of(rotary, (0.0, 0.0, 0.0), 0.1)
            found[path.name] = (
                lambda folder, n=path.name, r=axes: read_toolpath(folder / n, feed=0.01, rotary=r),
                {path.name: path.read_bytes()},
            )
    files = _post("csv")
    found["program.csv"] = (lambda folder, n=next(iter(files)): read_csv(folder / n), files)
    for post in ("npz", "hdf5", "ros2-json", "ros2-yaml", "halstreamer"):
        found[post] = (lambda folder, p=post: read_post(folder, p), _post(post))
    found["job.toml"] = (
        lambda folder: Job.load(folder / "job.toml").digest,
        {"job.toml": job_text().encode(), "part.stl": _stl()},
    )
    found["machine.toml"] = (
        lambda folder: load_machine(folder / "machine.toml"),
        {"machine.toml": library.read_bytes()},
    )
    return found


_WORDS = (
    b"1e99999999999999999999", b"9" * 5000, b"18446744073709551616", b"-1", b"0", b"nan", b"inf", b"1_0", b"1e308",
    b"0x" + b"f" * 5000, b"[" * 3000, b"{a=" * 2000, b"((" * 3000, b"a." * 3000, b" " * 20000, b"\n" * 20000, b"\t" * 9000,
    b"\0", b"\xff\xfe", b"\xef\xbb\xbf", "\u0661".encode(), b"1" * 200_000, b"\"" * 5, b"'''", b"\r", b"1.5", b"2147483648",
    b"99999999999999999999", b"[[[[]]]]", b"<g>" * 2000, b"#" * 3000, b",", b";", b"/" * 3000, b"$", b"1e300", b"1e-320",
)  # fmt: skip
_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")


def spoiled(data: bytes, rng: np.random.Generator) -> bytes:
    """Return data with one to three faults."""
    for _ in range(int(rng.integers(1, 4))):
        at, until = sorted(int(k) for k in rng.integers(0, len(data) + 1, 2))
        word = _WORDS[int(rng.integers(len(_WORDS)))]
        match int(rng.integers(9)):
            case 0:
                data = data[:at]
            case 1:
                flipped = bytearray(data)
                for k in rng.integers(0, max(len(data), 1), int(rng.integers(1, 20))):
                    if flipped:
                        flipped[k] ^= 1 << int(rng.integers(8))
                data = bytes(flipped)
            case 2:
                data = data[:at] + data[until:]
            case 3:
                data = data[:at] + word + data[at:]
            case 4:
                data = data[:until] + data[at:until] * int(rng.integers(1, 50)) + data[until:]
            case 5 | 6:
                numbers = list(_NUMBER.finditer(data))
                if numbers:
                    number = numbers[int(rng.integers(len(numbers)))]
                    data = data[: number.start()] + word + data[number.end() :]
            case 7:
                lines = data.split(b"\n")
                data = b"\n".join(lines[: int(rng.integers(len(lines) + 1))]) + b"\n"
            case _:
                lines = data.split(b"\n")
                a, b = (int(k) for k in rng.integers(0, len(lines), 2))
                lines[a], lines[b] = lines[b], lines[a]
                data = b"\n".join(lines)
    return data[:3_000_000]


class TooSlowError(BaseException):
    """The time is up; not an Exception, so that no reader takes it for a broken file."""


def _up(*_: object) -> None:
    raise TooSlowError


def main(seed: int, count: int, names: list[str]) -> None:
    """Read `count` spoiled files of each kind; print the kind, the number and the fault of each bad answer."""
    from pentapod.base.errors import InputError

    every = readers()
    for name in names or every:
        read, files = every[name]
        first = next(iter(files))
        for k in range(count):
            rng = np.random.default_rng([seed, k, *name.encode()])
            with tempfile.TemporaryDirectory() as place:
                folder = Path(place)
                for file, content in files.items():
                    (folder / file).parent.mkdir(parents=True, exist_ok=True)
                    (folder / file).write_bytes(spoiled(content, rng) if file == first and k else content)
                print(f"at {name} {k}", flush=True, file=sys.stderr)  # the last one where the process dies
                signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
                try:
                    read(folder)
                except InputError as error:
                    if k == 0 or "\n" in str(error) or len(str(error)) > 2000:
                        print(f"{name} {k}: {error}"[:3000], flush=True)
                except (Exception, TooSlowError) as error:
                    where = traceback.extract_tb(error.__traceback__)[-1]
                    own = [f for f in traceback.extract_tb(error.__traceback__) if "pentapod" in f.filename][-1:]
                    at = [f"{Path(f.filename).name}:{f.lineno}" for f in (*own, where)]
                    print(f"{name} {k}: {type(error).__name__}: {str(error)[:200]} at {at}", flush=True)
                finally:
                    signal.setitimer(signal.ITIMER_PROF, 0.0)


if __name__ == "__main__":
    import warnings

    warnings.simplefilter("ignore")
    signal.signal(signal.SIGPROF, _up)
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    main(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:])
