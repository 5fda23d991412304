"""The text of a machine file with a remark on each key, to start a machine of one's own from another one."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import wrap
from typing import Any, cast

from pydantic_core import PydanticUndefined

from pentapod.base.errors import MachineError
from pentapod.base.toml import parsed, toml_text
from pentapod.machine.families import FAMILIES
from pentapod.machine.machine import read_machine
from pentapod.machine.reader import machine_bytes
from pentapod.machine.tables import MachineTables

WIDE = 100
"""Characters of a line of remarks."""


def commented_machine(like: str, name: str) -> str:
    """Return the text of a machine file with the values of another machine and a remark on each key.

    Keys that the other file leaves out stand as remarks, with their default. Raises MachineError.
    """
    content = parsed(machine_bytes(like).decode("utf-8-sig"), like, MachineError)
    family = str(content.get("geometry", {}).get("family", "quadratic"))
    head = f"Made from {like}: measure each number on your machine. `pentapod machine check FILE` judges the file."
    lines = [*_remark(head), f'name = "{name}"', _set("description", content.get("description", ""))]
    for table, field in MachineTables.model_fields.items():
        model: Any = FAMILIES.find(family).table if table == "geometry" else field.annotation
        keys: Mapping[str, Any] = getattr(model, "model_fields", {})
        given = content.get(table)
        if keys and isinstance(given, Mapping):
            lines += ["", f"[{table}]"]
            for key, of in keys.items():
                lines += _key(key, of, cast("Mapping[str, Any]", given))
    text = "\n".join(lines) + "\n"
    read_machine(text, name)
    return text


def _key(key: str, field: Any, given: Mapping[str, Any]) -> list[str]:
    """Return the lines of a key: what it is, and its value, or its default as a remark."""
    remark = _remark(str(field.description or ""))
    if key in given:
        return [*remark, _set(key, given[key])]
    default = field.get_default(call_default_factory=True, validated_data={})
    if default is PydanticUndefined or default is None:
        return []
    if hasattr(default, "tolist"):
        default = default.tolist()
    if not isinstance(default, str | bool | int | float) or default in (float("inf"), float("-inf")):
        return [*remark, f"# {key}: not used here"]
    return [*remark, f"# {_set(key, default)}"]


def _set(key: str, value: Any) -> str:
    return toml_text({key: value}).strip()


def _remark(text: str) -> list[str]:
    return [f"# {line}" for line in wrap(text, WIDE, break_long_words=False, break_on_hyphens=False)]
