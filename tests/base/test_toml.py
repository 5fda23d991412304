"""TOML files that people write: what is said of bad ones."""

from pathlib import Path

import pytest

from pentapod.base.errors import JobError
from pentapod.base.toml import line_of, parsed, read_toml

TEXT = """\
name = "x"

[legs]
# max = 3
min = 1

[ tool ]
min = 2
"""


@pytest.mark.parametrize(
    ("where", "line"),
    [
        (["name"], 1),
        (["legs"], 3),
        (["legs", "min"], 5),
        (["tool", "min", "0"], 8),
        (["tool", "max"], 7),
        (["x"], None),
    ],
)
def test_line_of_a_key_in_toml(where: list[str], line: int | None) -> None:
    assert line_of(TEXT, where) == line


def test_a_byte_order_mark_is_no_content(tmp_path: Path) -> None:
    file = tmp_path / "job.toml"
    file.write_bytes(b"\xef\xbb\xbfa = 1\n")
    assert parsed(read_toml(file, "job", JobError), file, JobError) == {"a": 1}


@pytest.mark.parametrize(("text", "line"), [("a = \n", 1), ("a = 1\n\nb == 2\n", 3), ('a = 1\nb = """', 2)])
def test_what_is_not_toml_is_told_with_its_line(text: str, line: int) -> None:
    with pytest.raises(JobError, match="not TOML") as caught:
        parsed(text, "job.toml", JobError)
    assert caught.value.line == line


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("a = 10,5", "decimal point"),
        ("a_mm = 6.0 mm  # wide", "alone: its unit is in the name"),
        ("a_mm_min = 1500mm/min", "alone: its unit is in the name"),
        ("a = [1, 2", None),
    ],
)
def test_a_decimal_comma_or_a_unit_behind_a_number_has_its_remedy(text: str, remedy: str | None) -> None:
    with pytest.raises(JobError, match=remedy or "not TOML") as caught:
        parsed(f"b = 1\n{text}\n", "job.toml", JobError)
    assert (caught.value.remedy is None) == (remedy is None)


def test_what_cannot_be_read_says_what_was_expected(tmp_path: Path) -> None:
    for path, words in (
        (tmp_path, "this is a folder; expected a job file"),
        (tmp_path / "no", "no such job file; start so"),
    ):
        with pytest.raises(JobError, match=words):
            read_toml(path, "job", JobError, start="start so")
