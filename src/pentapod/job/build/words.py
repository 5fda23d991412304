"""Errors of the library in the words of a job file: the key with its unit, and the value that stands there."""

from __future__ import annotations

from pentapod.base.errors import InputError
from pentapod.base.units import split_key
from pentapod.job.schema.job import Job

NO_CUT = "gouge.remedy"
"""Key of the error about a toolpath all of whose cuts gouge."""

TABLES = ("toolpath", "tolerance", "tool")
"""Tables in which the key of an option is looked for."""

FOLLOWS_FROM = {"step": ("tool", "diameter_mm"), "shortest": ("toolpath", "shortest_mm")}
"""Keys from which options follow that have no key of their own."""


def in_words_of(job: Job, error: InputError) -> InputError:
    """Return an error about an option of a toolpath as one about the key of the job; others as they are."""
    for table, key in _keys(job, str(error.key)):
        return job.error(table, key, error.what, expected=error.expected, remedy=error.remedy)
    return error


def _keys(job: Job, option: str) -> list[tuple[str, str]]:
    """Return the table and the key of an option of a job, if it has one."""
    found = [
        (table, key)
        for table in TABLES
        for key in type(getattr(job.tables, table)).model_fields
        if split_key(key)[0] == option and getattr(getattr(job.tables, table), key) is not None
    ]
    return found or [FOLLOWS_FROM[option]] if found or option in FOLLOWS_FROM else []
