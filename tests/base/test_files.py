import os

import pytest

from pentapod.base.errors import InputError
from pentapod.base.files import atomic_write


def test_atomic_write_replaces_and_leaves_nothing_else(tmp_path):
    target = tmp_path / "verdict.json"
    target.write_text("old")
    with atomic_write(target) as temporary:
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".json"
        assert target.read_text() == "old"
        temporary.write_text("new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


def interrupted(target, error):
    with atomic_write(target) as temporary:
        temporary.write_text("half of it")
        raise error


@pytest.mark.parametrize("interruption", [ValueError, KeyboardInterrupt, SystemExit])
@pytest.mark.parametrize("old", ["old", None])
def test_atomic_write_interrupted_keeps_the_old_file_or_none(tmp_path, interruption, old):
    target = tmp_path / "program.csv"
    if old is not None:
        target.write_text(old)
    with pytest.raises(interruption):
        interrupted(target, interruption)
    assert [p.name for p in tmp_path.iterdir()] == ([] if old is None else ["program.csv"])
    assert old is None or target.read_text() == old


def test_atomic_write_raises_errors_of_the_writer(tmp_path):
    with pytest.raises(OSError, match="disk full"):
        interrupted(tmp_path / "a", OSError("disk full"))
    assert list(tmp_path.iterdir()) == []


def test_atomic_write_to_an_impossible_place_is_bad_input(tmp_path):
    (tmp_path / "file").write_text("")
    for target in (tmp_path, tmp_path / "missing" / "a.csv", tmp_path / "file" / "a.csv"):
        with pytest.raises(InputError, match="cannot be written") as caught, atomic_write(target):
            pytest.fail("the block must not run")
        assert caught.value.file == target
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_atomic_write_keeps_the_usual_permissions(tmp_path):
    mask = os.umask(0o022)
    try:
        with atomic_write(tmp_path / "a") as temporary:
            temporary.write_text("x")
    finally:
        os.umask(mask)
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o644
