"""Write docs/reference/*.md from the code: job and machine files, commands, API. Run ``make reference``.

The pages are made of what the program itself reads: the models of the files, the commands' help, the docstrings. A test
compares them with the code, so they cannot drift.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from pentapod.cli.verbs import VERBS, cli
from pentapod.job.schema.strategies import job_strategies
from pentapod.job.schema.tables import JobTables, table_model
from pentapod.machine.calibration.calibration_file import CalibrationTables
from pentapod.machine.tables import MachineTables

HERE = Path(__file__).parent / "reference"
PACKAGES = (
    "pentapod",
    "pentapod.base",
    "pentapod.mesh",
    "pentapod.cutters",
    "pentapod.kinematics",
    "pentapod.theory",
    "pentapod.toolpath",
    "pentapod.toolpath.formats",
    "pentapod.machine",
    "pentapod.planning",
    "pentapod.timing",
    "pentapod.program",
    "pentapod.program.posts",
    "pentapod.verify",
    "pentapod.simulate",
    "pentapod.simulate.recorded",
    "pentapod.job",
    "pentapod.batch",
)
_MADE = "<!-- Made from the code by docs/make_reference.py; change the code, then run `make reference`. -->\n\n"
_WIDE = 88


def pages() -> dict[str, str]:
    """Return the pages by their file names."""
    return {
        "job.md": _file_page(
            "The job file", "TOML. Paths are relative to the job file; an unknown key is an error.", _job_schema()
        ),
        "machine.md": _file_page(
            "The machine file",
            "TOML. Where legs have a number each, one number stands for all. "
            "`pentapod machine check FILE` judges a file.",
            MachineTables.model_json_schema(),
        ),
        "calibration.md": _file_page(
            "The calibration file",
            "TOML. `[calibration] file` of a machine file names it; [Machines as built](../as-built.md) explains it.",
            CalibrationTables.model_json_schema(),
        ),
        "commands.md": _MADE + "# Commands\n\n" + "\n".join(_commands()),
        "api.md": _MADE + "# Python API\n\nEverything is in metres, radians and seconds.\n\n" + "\n".join(_packages()),
    }


def _job_schema() -> dict[str, Any]:
    """Return the schema of job files, with the keys of all strategies and cutters."""
    schema = JobTables.model_json_schema()
    variants = [table_model("toolpath", name).model_json_schema() for name in job_strategies()]
    schema["properties"]["toolpath"] = {"oneOf": variants}
    schema["properties"]["tool"] = table_model("tool").model_json_schema()
    return schema


def _file_page(title: str, intro: str, schema: dict[str, Any]) -> str:
    required = set(schema.get("required", ()))
    parts = [f"{_MADE}# {title}\n\n{intro}\n"]
    plain = {k: v for k, v in schema["properties"].items() if not (_is_table(v, schema) or "oneOf" in v)}
    if plain:
        parts.append(_keys(plain, required, schema))
    for name, field in schema["properties"].items():
        if name in plain:
            continue
        parts.append(f"## `[{name}]`{'' if name in required else ' (may be left out)'}\n")
        if "oneOf" in field:
            parts += list(_union([_resolved(option, schema) for option in field["oneOf"]], schema))
        else:
            table = _resolved(field, schema)
            parts += [
                f"{table.get('description', '')}\n",
                _keys(table["properties"], set(table.get("required", ())), schema),
            ]
    return "\n".join(parts)


def _union(variants: list[dict[str, Any]], schema: dict[str, Any]) -> Iterator[str]:
    """Say the keys that several strategies share once, then those of each."""
    shared = {
        key: value
        for key, value in variants[0]["properties"].items()
        if sum(other["properties"].get(key) == value for other in variants) > len(variants) // 2
    }
    yield "Keys that most strategies take:\n"
    yield _keys(shared, set(), schema)
    for table in variants:
        properties = table["properties"]
        name = properties["strategy"]["default"]
        lacks = sorted(set(shared) - set(properties))
        yield f'### `strategy = "{name}"`\n\n{table.get("description", "")}\n'
        if lacks:
            yield "Not here: " + ", ".join(f"`{key}`" for key in lacks) + ".\n"
        own = {key: value for key, value in properties.items() if shared.get(key) != value and key != "strategy"}
        if own:
            yield _keys(own, set(table.get("required", ())), schema)


def _keys(properties: dict[str, Any], required: set[str], schema: dict[str, Any]) -> str:
    rows = ["| key | value | default | meaning |", "|---|---|---|---|"]
    for key, field in properties.items():
        resolved = _resolved(field, schema)
        default = "**needed**" if key in required else _default(field)
        rows.append(f"| `{key}` | {_kind(resolved, schema)} | {default} | {_cell(resolved.get('description', ''))} |")
    return "\n".join(rows) + "\n"


def _default(field: dict[str, Any]) -> str:
    value = field.get("default")
    if value is None:
        return ""
    return f"`{str(value).lower() if isinstance(value, bool) else repr(value).replace(chr(39), chr(34))}`"


def _kind(field: dict[str, Any], schema: dict[str, Any]) -> str:
    if "enum" in field:
        return " ".join(f"`{value!r}`".replace("'", '"') for value in field["enum"])
    if "const" in field:
        return f"`{field['const']!r}`".replace("'", '"')
    if "anyOf" in field:
        kinds = [_kind(_resolved(option, schema), schema) for option in field["anyOf"] if option.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    kind = field.get("type", "")
    if kind == "array":
        items = field["prefixItems"][0] if "prefixItems" in field else field.get("items", {})
        count = field.get("minItems") if field.get("minItems") == field.get("maxItems") else None
        inner = _kind(_resolved(items, schema), schema) if items else "number"
        return f"list of {count} × {inner}" if count else f"list of {inner}"
    words = {"number": "number", "integer": "whole number", "string": "text", "boolean": "`true` or `false`"}
    signs = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    limits = [f"{sign} {field[key]:g}" for key, sign in signs.items() if key in field]
    return ", ".join([words.get(str(kind), "number" if not kind else str(kind)), *limits])


def _resolved(field: dict[str, Any], schema: dict[str, Any]) -> dict[str, Any]:
    """Follow a reference, or the one option of a value that may be left out; what stands beside it wins."""
    if "$ref" in field:
        target = schema["$defs"][field["$ref"].rsplit("/", 1)[1]]
        return {**target, **{key: value for key, value in field.items() if key != "$ref"}}
    options = [option for option in field.get("anyOf", ()) if option.get("type") != "null"]
    if len(options) == 1:
        beside = {key: value for key, value in field.items() if key != "anyOf"}
        return {**_resolved(options[0], schema), **beside}
    return field


def _is_table(field: dict[str, Any], schema: dict[str, Any]) -> bool:
    return "properties" in _resolved(field, schema)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _commands() -> Iterator[str]:
    yield _help(cli, "pentapod", "##")
    for verb in VERBS:
        command = cli.get_command(click.Context(cli), verb)
        if command is None:
            raise LookupError(verb)
        yield _help(command, f"pentapod {verb}", "##")
        if isinstance(command, click.Group):
            for name, part in command.commands.items():
                yield _help(part, f"pentapod {verb} {name}", "###")


def _help(command: click.Command, name: str, level: str) -> str:
    # With the names that `cli` gives its help option: click remembers the option that is asked for first.
    shared: dict[str, Any] = dict(cli.context_settings)
    context = click.Context(command, info_name=name, max_content_width=_WIDE, terminal_width=_WIDE, **shared)
    return f"{level} {name}\n\n```text\n{command.get_help(context).rstrip()}\n```\n"


def _packages() -> Iterator[str]:
    for package in PACKAGES:
        module = import_module(package)
        yield f"## {package}\n\n{_first_line(module)}\n"
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.ismodule(thing) or _is_handed_on(thing, package):
                continue
            yield f"- `{name}{_signature(thing)}`: {_first_line(thing)}"
        yield ""


def _is_handed_on(thing: Any, package: str) -> bool:
    """Return whether a package shows what another one on this page holds. The top level shows all."""
    home = getattr(thing, "__module__", None) or package
    return (
        package != "pentapod"
        and not home.startswith(f"{package}.")
        and any(home.startswith(f"{other}.") for other in PACKAGES[1:])
    )


def _signature(thing: Any) -> str:
    if not inspect.isfunction(thing):
        return ""
    names = [
        ("*" if p.kind is p.VAR_POSITIONAL else "") + p.name + ("=…" if p.default is not p.empty else "")
        for p in inspect.signature(thing).parameters.values()
    ]
    return f"({', '.join(names)})"


def _first_line(thing: Any) -> str:
    if not (inspect.ismodule(thing) or inspect.isclass(thing) or inspect.isroutine(thing)):
        return f"a constant, `{type(thing).__name__}`"
    text = inspect.getdoc(thing) or ""
    return re.sub(r"\s+", " ", text.split("\n\n")[0]).strip()


def main() -> None:
    """Write the pages."""
    HERE.mkdir(exist_ok=True)
    for name, text in pages().items():
        (HERE / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
