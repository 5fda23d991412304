"""3MF files: strict reader of the core specification, with bodies in further parts of the archive.

The format: https://3mf.io/spec. An archive holds a model in XML: objects are a mesh or placed components, and the build
is a list of placed objects. Materials, supports and thumbnails are ignored; extensions that change the shape, and
anything that does not add up, are refused, so that no part of the surface is lost.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.parsers import expat

import numpy as np

from pentapod.base.archives import MOST_ENTRIES, MOST_UNPACKED
from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.mesh.io.registry import MOST_FACETS, MeshData, MeshFormat, ReadOptions
from pentapod.mesh.io.text import EXPORT_AGAIN

_UNITS = {
    "micron": ("mm", 1e-3), "millimeter": ("mm", 1.0), "centimeter": ("cm", 1.0), "inch": ("inch", 1.0),
    "foot": ("inch", 12.0), "meter": ("m", 1.0),
}  # fmt: skip
_MODEL = "3D/3dmodel.model"
_HARMLESS = ("/production/", "/material/", "/trianglesets/", "/core/", "/slice/")
"""In the namespaces of extensions that do not change the shape."""
_SUPPORTS = ("support", "solidsupport")

Placed = tuple[str, str, Floats]
"""Part of the archive, object and transform (4, 3) of a component."""


class _Numbers:
    """Numbers from texts. Texts are converted by the hundred thousand: they take much more memory."""

    batch = 100_000

    def __init__(self) -> None:
        self._texts: list[str] = []
        self._blocks: list[Floats] = []

    def add(self, *texts: str) -> None:
        """Add texts. Raises ValueError for one that is no finite number."""
        self._texts += texts
        if len(self._texts) > self.batch:
            self._convert()

    def rows(self) -> Floats:
        """Return the numbers (n, 3). Raises ValueError as `add`."""
        self._convert()
        return np.concatenate(self._blocks).reshape(-1, 3)

    def _convert(self) -> None:
        self._blocks.append(_floats(self._texts))
        self._texts = []


@dataclass
class _Object:
    """A body, or placed components. facets: how many the body has."""

    kind: str
    vertices: _Numbers = field(default_factory=_Numbers)
    corners: _Numbers = field(default_factory=_Numbers)
    facets: int = 0
    parts: list[Placed] = field(default_factory=list[Placed])


class _Model:
    """A model part of the archive: its objects by number, and the items of its build."""

    def __init__(self, path: Path, name: str) -> None:
        self.path, self.name, self.unit = path, name, "millimeter"
        self.objects: dict[str, _Object] = {}
        self.items: list[Placed] = []
        self._spaces: dict[str, str] = {}
        self._current: _Object | None = None
        self._parser = expat.ParserCreate(namespace_separator="}")
        self._parser.StartElementHandler = self._start
        self._parser.StartNamespaceDeclHandler = self._space
        self._parser.StartDoctypeDeclHandler = self._doctype

    def parse(self, text: bytes) -> None:
        """Read the part. Raises MeshError with its line."""
        try:
            self._parser.Parse(text, True)
        except expat.ExpatError as error:
            raise self.wrong(str(error).split(":")[0]) from error
        except KeyError as error:
            raise self.wrong(f"an attribute is missing: {error.args[0]}") from error
        except MeshError:
            raise
        except ValueError as error:
            raise self.wrong("not a finite number", str(error)[:60]) from error

    def wrong(self, what: str, value: object = None) -> MeshError:
        """Return the error about the line that is being read."""
        where = f"{self.name} line {self._parser.CurrentLineNumber}"
        return MeshError(
            f"cannot be read as 3MF: {where}: {what}", file=self.path, value=value, remedy=EXPORT_AGAIN
        )  # fmt: skip

    def _doctype(self, *_: Any) -> None:
        raise self.wrong("a document type is not allowed")

    def _space(self, prefix: str | None, uri: str) -> None:
        self._spaces[prefix or ""] = uri

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        space, _, tag = name.rpartition("}")
        if "/core/" not in space:
            return
        match tag:
            case "vertex":
                self._object().vertices.add(attributes["x"], attributes["y"], attributes["z"])
            case "triangle":
                self._object().corners.add(attributes["v1"], attributes["v2"], attributes["v3"])
                self._object().facets += 1
            case "model":
                self.unit = attributes.get("unit", self.unit)
                if self.unit not in _UNITS:
                    raise self.wrong("an unknown unit", self.unit)
                for prefix in attributes.get("requiredextensions", "").split():
                    if not any(word in self._spaces.get(prefix, "") for word in _HARMLESS):
                        raise self.wrong("it needs an extension that is not read", self._spaces.get(prefix, prefix))
            case "object":
                if attributes["id"] in self.objects:
                    raise self.wrong("an object is there twice", attributes["id"])
                self._current = self.objects[attributes["id"]] = _Object(attributes.get("type", "model"))
            case "component":
                self._object().parts.append(self._placed(attributes))
            case "item":
                self.items.append(self._placed(attributes))
            case _:
                pass

    def _object(self) -> _Object:
        if self._current is None:
            raise self.wrong("geometry outside of objects")
        return self._current

    def _placed(self, attributes: dict[str, str]) -> Placed:
        part = next((value for key, value in attributes.items() if key.rpartition("}")[2] == "path"), self.name)
        text = attributes.get("transform", "1 0 0 0 1 0 0 0 1 0 0 0")
        numbers = _floats(text.split())
        if len(numbers) != 12:
            raise self.wrong("a transform is not twelve numbers", text[:60])
        return part.lstrip("/"), attributes["objectid"], numbers.reshape(4, 3)


class _Archive:
    """The models of an archive, read when they are needed."""

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        self.path, self.archive, self.models = path, archive, dict[str, _Model]()
        self._sizes = {entry.filename.lstrip("/").lower(): entry for entry in archive.infolist()}
        self._left, self._counts = MOST_UNPACKED, dict[tuple[str, str], int]()
        self._unit = ""

    def model(self, name: str) -> _Model:
        """Return a model by its name in the archive."""
        if name not in self.models:
            entry = self._sizes.get(name.lower())
            if entry is None:
                raise MeshError("a part of the archive is missing", file=self.path, value=name, remedy=EXPORT_AGAIN)
            self._left -= entry.file_size
            if self._left < 0:
                most = f"at most {MOST_UNPACKED / 1e6:,.0f} MB unpacked"
                raise MeshError("the archive is too large", file=self.path, expected=most)
            made = _Model(self.path, name)
            # With a number of bytes the decompression stops there, whatever the archive holds.
            with self.archive.open(entry) as source:
                made.parse(source.read(entry.file_size))
            self._unit = self._unit or made.unit
            if made.unit != self._unit:
                what = f'a part of the archive is in "{made.unit}", the model in "{self._unit}"'
                raise MeshError(what, file=self.path, value=name, remedy="export it in one unit")
            self.models[name] = made
        return self.models[name]

    def count(self, part: str, number: str, above: tuple[tuple[str, str], ...] = ()) -> int:
        """Return how many facets an object unfolds to. Raises MeshError for one that is missing or in itself."""
        key = (part, number)
        if key in above or len(above) > MOST_ENTRIES // 10:
            what = "an object is a component of itself" if key in above else "components are nested too deep"
            raise MeshError(what, file=self.path, value=number, remedy=EXPORT_AGAIN)
        if key not in self._counts:
            found = self.model(part).objects.get(number)
            if found is None:
                raise MeshError("an object is missing", file=self.path, value=number, remedy=EXPORT_AGAIN)
            inside = sum(max(self.count(*placed[:2], (*above, key)), 1) for placed in found.parts)
            self._counts[key] = found.facets + inside
        return self._counts[key]

    def bodies(self, placed: Placed, at: Floats) -> list[tuple[Floats, Ints]]:
        """Return vertices and facets of each body of a placed object."""
        part, number, matrix = placed
        here = matrix @ at[:3]
        here[3] += at[3]
        found = self.model(part).objects[number]
        own = [self._body(found, number, here)] if found.facets else []
        return [*own, *(body for inner in found.parts for body in self.bodies(inner, here))]

    def _body(self, found: _Object, number: str, matrix: Floats) -> tuple[Floats, Ints]:
        try:
            vertices, faces = found.vertices.rows(), found.corners.rows()
        except ValueError as error:
            what = f"cannot be read as 3MF: object {number}: not a finite number"
            raise MeshError(what, file=self.path, value=str(error)[:60], remedy=EXPORT_AGAIN) from error
        if (faces != np.rint(faces)).any():
            what = f"cannot be read as 3MF: object {number}: a facet is not of whole numbers"
            raise MeshError(what, file=self.path, remedy=EXPORT_AGAIN)
        if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
            what = f"a facet uses a vertex that is not there; object {number} has {len(vertices):,}"
            raise MeshError(what, file=self.path, remedy=EXPORT_AGAIN)
        mirrored = np.linalg.det(matrix[:3]) < 0.0
        return vertices @ matrix[:3] + matrix[3], (faces[:, ::-1] if mirrored else faces).astype(np.intp)


def _floats(texts: list[str]) -> Floats:
    """Return finite numbers. Raises ValueError with the text that is none."""
    for text in texts:
        if "_" in text or not text.isascii():
            raise ValueError(text)
    values = np.array(list(map(float, texts)), dtype=np.float64)
    if not np.isfinite(values).all():
        raise ValueError(texts[int(np.flatnonzero(~np.isfinite(values))[0])])
    return values


def _read(path: Path, data: bytes, options: ReadOptions) -> MeshData:
    """Return the facets of all bodies that the build places. Raises MeshError."""
    if data.count(b"PK\x01\x02") > MOST_ENTRIES:
        raise MeshError("an archive of too many files", file=path, expected=f"at most {MOST_ENTRIES:,}")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return _facets(_Archive(path, archive), options)
    except MeshError:
        raise
    except (zipfile.BadZipFile, zlib.error, OSError, EOFError, RuntimeError, NotImplementedError, ValueError) as error:
        raise MeshError("a broken archive: it may have been cut off", file=path, remedy=EXPORT_AGAIN) from error


def _facets(archive: _Archive, _options: ReadOptions) -> MeshData:
    model = archive.model(_MODEL)
    unit, factor = _UNITS[model.unit]
    kept = [item for item in model.items if archive.count(*item[:2]) >= 0 and not _is_support(archive, item)]
    if sum(max(archive.count(*item[:2]), 1) for item in kept) > MOST_FACETS:
        raise MeshError("it unfolds to too many facets", file=archive.path, expected=f"at most {MOST_FACETS:,}")
    still = np.concatenate([np.eye(3), np.zeros((1, 3))])
    bodies = [body for item in kept for body in archive.bodies(item, still)]
    left_out = len(model.items) - len(kept)
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in bodies)])
    faces = [facets + start for (_, facets), start in zip(bodies, starts.tolist(), strict=False)]
    return MeshData(
        factor * np.concatenate([np.zeros((0, 3)), *(vertices for vertices, _ in bodies)]),
        np.concatenate([np.zeros((0, 3), dtype=np.intp), *faces]),
        (f"{left_out} supports left out",) if left_out else (),
        unit,
    )


def _is_support(archive: _Archive, item: Placed) -> bool:
    return archive.model(item[0]).objects[item[1]].kind in _SUPPORTS


def _check(path: Path, head: bytes, _size: int) -> None:
    if not head.startswith(b"PK"):
        raise MeshError("cannot be read as 3MF: not an archive", file=path)


FORMAT = MeshFormat(_read, _check, states_unit=True)
