"""What all tables of a job file share: strictness, types of values, and the error of a rule."""

from __future__ import annotations

from typing import Annotated, NoReturn

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

Vector = tuple[float, float, float]
Row = tuple[float, float, float, float]
Positive = Annotated[float, Field(gt=0.0)]


def wrong(key: str, what: str, expected: str) -> NoReturn:
    """Raise the error of a rule that spans several keys; `key` is the one to name."""
    raise PydanticCustomError("rule", "{what}", {"key": key, "what": what, "expected": expected})


class Table(BaseModel):
    """A table of the job file: unknown keys, wrong types, NaN and infinity are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
