"""design.toml: what a search for machines varies, wants and needs, read with one clear error for whatever is wrong."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, ValidationError, create_model

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError, nearest
from pentapod.base.keys import Key, declared, fields_from
from pentapod.base.tables import TomlTable, problem_of, table_of
from pentapod.base.toml import line_of, parsed, read_toml
from pentapod.base.values import Value
from pentapod.design.quantities import BY_KEY, QUANTITIES
from pentapod.design.unknowns import Unknowns
from pentapod.job.schema.job import Job
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.machine.fields import LIST_OF_2
from pentapod.machine.machine import Machine


@dataclass(frozen=True)
class StartKeys:
    """The machine that the search starts from; what is not an unknown stays as there."""

    machine: Annotated[str, Key("", "a shipped machine's name, or a machine file relative to this file", needed=True)]
    leg_stiffness: Annotated[
        float | None, Key("n_um", "stiffness of a leg along itself: needed for the quantity `stiffness_n_um`", gt=0.0)
    ] = None


@dataclass(frozen=True, eq=False)
class UnknownKeys:
    """The ranges [least, greatest] of what the search varies; what is left out stays as in the start."""

    base: Annotated[Floats | None, Key("mm", "x and y of each base joint", kind=LIST_OF_2)] = None
    delta: Annotated[Floats | None, Key("", "delta of the quadratic family", kind=LIST_OF_2)] = None
    platform: Annotated[
        Floats | None, Key("mm", "each platform joint along the line: makes a general machine", kind=LIST_OF_2)
    ] = None
    beyond: Annotated[Floats | None, Key("mm", "from the lowest platform joint to the tip", kind=LIST_OF_2)] = None
    centre_x: Annotated[Floats | None, Key("mm", "x of the work volume's centre", kind=LIST_OF_2)] = None
    centre_y: Annotated[Floats | None, Key("mm", "y of the work volume's centre", kind=LIST_OF_2)] = None
    centre_z: Annotated[Floats | None, Key("mm", "z of the work volume's centre", kind=LIST_OF_2)] = None
    diameter: Annotated[Floats | None, Key("mm", "diameter of the work volume", kind=LIST_OF_2)] = None
    height: Annotated[Floats | None, Key("mm", "height of the work volume", kind=LIST_OF_2)] = None
    tilt: Annotated[Floats | None, Key("deg", "half angle of the cone of tool axes", kind=LIST_OF_2)] = None


@dataclass(frozen=True)
class ObjectiveKeys:
    """What the search makes small and large, by the names of [at_most]: one or more, each with its unit."""

    minimise: Annotated[tuple[str, ...], Key("", "quantities to make small", kind=list[str])] = ()
    maximise: Annotated[tuple[str, ...], Key("", "quantities to make large", kind=list[str])] = ()


@dataclass(frozen=True)
class PartKeys:
    """Parts that a machine must be able to make."""

    jobs: Annotated[
        tuple[str, ...], Key("", "job files, relative to this file; each is planned on every design", kind=list[str])
    ] = ()
    poses: Annotated[int, Key("", "poses of each job's toolpath that the search looks at", ge=4, le=2000)] = 48


@dataclass(frozen=True)
class SearchKeys:
    """How long is searched. The result follows from these numbers, not from cores or chance."""

    population: Annotated[int, Key("", "designs in a generation", ge=8, le=10_000)] = 100
    generations: Annotated[int, Key("", "how many generations", ge=1, le=1_000_000)] = 200
    seed: Annotated[int, Key("", "of the random numbers", ge=0)] = 1
    exchange: Annotated[
        int, Key("", "after so many generations the worst poses of the best designs join the sample", ge=1)
    ] = 20
    members: Annotated[int, Key("", "designs of the front to be proven, at most", ge=1, le=1000)] = 12


def _needs(name: str, what: str) -> Any:
    fields: dict[str, Any] = {
        q.key: (float | None, Field(default=None, description=q.meaning)) for q in QUANTITIES.values()
    }
    return create_model(name, __base__=TomlTable, __module__=__name__, __doc__=what, **fields)


StartTable, UnknownTable, ObjectiveTable, PartTable, SearchTable = (
    table_of(keys) for keys in (StartKeys, UnknownKeys, ObjectiveKeys, PartKeys, SearchKeys)
)
AtMostTable = _needs("AtMostTable", "Needs: what must not be more in any pose.")
AtLeastTable = _needs("AtLeastTable", "Needs: what must not be less in any pose.")
_TABLES: dict[str, Any] = {
    "start": (StartTable, ...),
    "unknowns": (UnknownTable, ...),
    "objectives": (ObjectiveTable, ...),
    "at_most": (AtMostTable, Field(default_factory=AtMostTable)),
    "at_least": (AtLeastTable, Field(default_factory=AtLeastTable)),
    "parts": (PartTable, Field(default_factory=PartTable)),
    "search": (SearchTable, Field(default_factory=SearchTable)),
}
DesignTables = create_model(
    "DesignTables", __base__=TomlTable, __module__=__name__, __doc__="A design file.", **_TABLES
)
"""A whole design file."""


@dataclass(frozen=True, eq=False)
class Need(Value):
    """A bound of a quantity, SI. sense: 1 for at most, -1 for at least."""

    quantity: str
    sense: int
    bound: float


@dataclass(frozen=True, eq=False)
class DesignFile(Value):
    """What a design file asks for. objectives: (quantity, sense), sense 1 to make it small. jobs: those of [parts]."""

    path: Path
    text: str
    machine: Machine
    machine_name: str
    leg_stiffness: float | None
    unknowns: Unknowns
    objectives: tuple[tuple[str, int], ...]
    needs: tuple[Need, ...]
    jobs: tuple[Job, ...]
    part_poses: int
    search: SearchKeys

    @classmethod
    def load(cls, path: Path) -> DesignFile:
        """Return the design file's content. Raises InputError: one line with file, line, key, value and remedy."""
        text = read_toml(path, "design", InputError, start="docs/howto/design.md has one")
        content = parsed(text, path, InputError)
        try:
            tables: Any = DesignTables.model_validate(content)
        except ValidationError as error:
            where, details = problem_of(error, DesignTables, _table)
            raise InputError(file=path, line=line_of(text, where), **details) from error

        def wrong(table: str, key: str, what: str, **details: Any) -> InputError:
            return InputError(what, file=path, line=line_of(text, (table, key)), key=f"{table}.{key}", **details)

        local = path.parent / tables.start.machine
        name = str(local) if tables.start.machine.endswith(".toml") else tables.start.machine
        machine = Machine.load(name)
        if not isinstance(machine.robot, LinearPentapod | GeneralPentapod) or machine.guides is not None:
            raise wrong(
                "start", "machine", "not a machine that the search can vary", value=tables.start.machine,
                expected="a quadratic or general family without guides or calibration",
            )  # fmt: skip
        stiffness = fields_from(StartKeys, tables.start).get("leg_stiffness")
        ranges = {item.field: getattr(tables.unknowns, item.file_key) for item in declared(UnknownKeys)}
        for item in declared(UnknownKeys):
            if (given := ranges[item.field]) is not None and not given[0] < given[1]:
                raise wrong("unknowns", item.file_key, "not a range", value=given, expected="the least value first")
        si = fields_from(UnknownKeys, tables.unknowns)
        if not si:
            raise wrong("unknowns", "base_mm", "nothing varies", expected="a range of at least one unknown")
        if "delta" in si and ("platform" in si or not isinstance(machine.robot, LinearPentapod)):
            raise wrong("unknowns", "delta", "a general machine has no delta", expected="platform_mm in place of delta")
        objectives = [
            (_named(name, key, wrong), sense)
            for key, sense in (("minimise", 1), ("maximise", -1)) for name in getattr(tables.objectives, key)
        ]  # fmt: skip
        if not objectives:
            raise wrong("objectives", "minimise", "there is no objective", expected="one or more quantities")
        needs = [
            Need(q.name, sense, q_si)
            for table, sense in (("at_most", 1), ("at_least", -1)) for q in QUANTITIES.values()
            if (q_si := getattr(getattr(tables, table).si, q.name)) is not None
        ]  # fmt: skip
        asked = {name for name, _ in objectives} | {need.quantity for need in needs}
        if "stiffness" in asked and stiffness is None:
            raise wrong("start", "leg_stiffness_n_um", "the key is missing", expected="N/µm: stiffness_n_um is asked")
        unknowns = Unknowns.of(machine, si)
        if "singular_distance" in asked and unknowns.start.delta is None:
            raise wrong("at_least", "singular_distance_mm", "not known for the general family",
                        remedy="bound amplification: it is infinite on a singularity")  # fmt: skip
        jobs = tuple(Job.load(path.parent / name) for name in tables.parts.jobs)
        search = SearchKeys(**fields_from(SearchKeys, tables.search))
        return cls(path, text, machine, name, stiffness, unknowns, tuple(objectives), tuple(needs), jobs,
                   tables.parts.poses, search)  # fmt: skip


def _named(name: str, key: str, wrong: Any) -> str:
    """Return the quantity of a key's name."""
    if name not in BY_KEY:
        raise wrong("objectives", key, "no such quantity", value=name, remedy=nearest(name, BY_KEY))
    return BY_KEY[name].name


def _table(name: str) -> type[BaseModel] | None:
    """Return the model of a table; None for a key outside the tables."""
    return _TABLES[name][0] if name in _TABLES else None
