import tomllib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod.base.errors import InputError, ProgramError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import COMPONENTS
from pentapod.numerics.kernels import kernels_used
from pentapod.program import Program, Provenance, quantised, read_csv, write_csv
from pentapod.toolpath.linking.partition import Piece

INF = float("inf")
SOURCE = Provenance("desk", "m123", "j456", "0.1.0")


def rotation(seed):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def program(rows=50, period=1e-3, seed=0, **changes):
    rng = np.random.default_rng(seed)
    parts = {
        "period": period,
        "legs": quantised(rng.uniform(0.3, 1.2, (rows, 5))),
        "interpolation": "linear",
        "component": COMPONENTS[seed % 4],
        "placement": RigidTransform(rotation(seed), rng.normal(size=3)),
        "provenance": SOURCE,
    }
    return Program(**{**parts, **changes})


def same(a, b):
    for x, y in (
        (a.legs, b.legs),
        (a.placement.rotation, b.placement.rotation),
        (a.placement.translation, b.placement.translation),
        (a.times, b.times),
    ):
        assert x.tobytes() == y.tobytes()
    assert (a.period, a.interpolation, a.component, a.provenance) == (
        b.period,
        b.interpolation,
        b.component,
        b.provenance,
    )


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(2, 400),
    period=st.one_of(
        st.sampled_from([1e-3, 1e-4, 2e-3, 1 / 1500, 0.004, 1 / 3]), st.floats(1e-6, 1.0, allow_subnormal=False)
    ),
    size=st.floats(1e-3, 9e3),
    interpolation=st.sampled_from(["linear", "cubic"]),
    names=st.lists(st.text(st.characters(exclude_categories=["Cs"]), max_size=20), min_size=4, max_size=4),
)
def test_reading_gives_back_every_bit(tmp_path_factory, seed, rows, period, size, interpolation, names):
    path = tmp_path_factory.mktemp("p") / "program.csv"
    legs = np.random.default_rng(seed).uniform(size * 1e-3, size, (rows, 5))
    translation = np.random.default_rng(seed).normal(size=3) * size
    before = program(
        seed=seed,
        period=period,
        legs=quantised(legs),
        interpolation=interpolation,
        placement=RigidTransform(rotation(seed), translation),
        provenance=Provenance(*names),
    )
    with kernels_used("never"):
        after = read_csv(write_csv(before, path))
    same(before, after)
    with kernels_used("always"):
        same(before, read_csv(path))
    first = path.read_bytes()
    write_csv(after, path)
    assert path.read_bytes() == first


@given(st.floats(1e-9, 9_999.0))
def test_quantising_is_idempotent_and_fine(x):
    q = quantised(np.full(5, x))
    assert np.array_equal(quantised(q), q)
    assert abs(q[0] - x) <= 0.5e-11 + 4e-16 * x


@given(st.floats(-1e4, 1e4), st.integers(-300, 0))
def test_any_translation_survives_millimetres(tmp_path_factory, x, exponent):
    path = tmp_path_factory.mktemp("p") / "p.csv"
    before = program(2, placement=RigidTransform(np.eye(3), [x, -0.0, 10.0**exponent]))
    same(before, read_csv(write_csv(before, path)))


def test_the_file_is_what_the_design_says(tmp_path):
    legs = np.array([[0.5, 0.6, 0.7, 0.8, 0.9], [0.50000000001, 0.6, 0.7, 0.8, 1.25]])
    placement = RigidTransform(np.eye(3), [0.1, -0.25, 0.3])
    text = write_csv(program(legs=legs, placement=placement), tmp_path / "p.csv").read_text()
    assert text.splitlines() == [
        "# pentapod_program = 1",
        '# pentapod_version = "0.1.0"',
        '# machine = "desk"',
        '# machine_digest = "m123"',
        '# job_digest = "j456"',
        "# period_s = 0.001",
        '# interpolation = "linear"',
        '# component = "++"',
        "# placement_mm = [[1.0, 0.0, 0.0, 100.0], [0.0, 1.0, 0.0, -250.0],"
        " [0.0, 0.0, 1.0, 300.0], [0.0, 0.0, 0.0, 1.0]]",
        "# rows = 2",
        "time_s,leg1_mm,leg2_mm,leg3_mm,leg4_mm,leg5_mm",
        "0.000000,500.00000000,600.00000000,700.00000000,800.00000000,900.00000000",
        "0.001000,500.00000001,600.00000000,700.00000000,800.00000000,1250.00000000",
    ]
    header = tomllib.loads("\n".join(line[2:] for line in text.splitlines() if line.startswith("#")))
    assert header["rows"] == 2


def test_carriage_returns_of_another_system_are_read(tmp_path):
    before = program()
    path = write_csv(before, tmp_path / "p.csv")
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    same(before, read_csv(path))
    with kernels_used("always"):
        same(before, read_csv(path))


@pytest.mark.parametrize(
    "text", ["500.123456789012345678", "5.00e2", "+500.25", "00000000000500.25", "500.", "500", " 500.5"]
)
def test_a_number_is_read_as_float_reads_it_however_it_is_written(tmp_path, text):
    path = write_csv(program(), tmp_path / "p.csv")
    lines = path.read_text(encoding="utf-8").splitlines()
    time, _, rest = lines[-1].split(",", 2)
    path.write_text("\n".join([*lines[:-1], f"{time},{text},{rest}"]) + "\n", encoding="utf-8")
    for policy in ("never", "always"):
        with kernels_used(policy):
            assert read_csv(path).legs[-1, 0] == quantised(np.full(5, 1e-3 * float(text)))[0]


# Corrupt files: each is refused by name, with file and line


def line_of(lines, k):
    """Index of row k among the lines."""
    return next(n for n, line in enumerate(lines) if line.startswith(b"time_s")) + 1 + k


def edit(change):
    def corrupt(data):
        lines = data.split(b"\n")[:-1]
        return b"\n".join(change(lines)) + b"\n"

    return corrupt


def in_row(k, change):
    def corrupt(lines):
        n = line_of(lines, k)
        return [*lines[:n], *change(lines[n]), *lines[n + 1 :]]

    return edit(corrupt)


def swapped(lines):
    n = line_of(lines, 20)
    return [*lines[:n], lines[n + 1], lines[n], *lines[n + 2 :]]


def header(old, new):
    def corrupt(data):
        assert old in data
        return data.replace(old, new, 1)

    return corrupt


def field(column, value):
    def change(row):
        fields = row.split(b",")
        fields[column] = value
        return [b",".join(fields)]

    return change


BAD = {
    "empty": (lambda _: b"", "empty", None),
    "blank": (lambda _: b"\n \n", "empty", None),
    "no program": (lambda _: b"solid part\nfacet\n", "not a pentapod program", 1),
    "another csv": (lambda d: d[d.index(b"time_s") :], "not a pentapod program", 1),
    "a job file": (lambda _: b"# A pentapod job: its keys\n[part]\n", "not a pentapod program", 1),
    "another header": (lambda d: b"# exported = 3\n" + d, "not a pentapod program", 1),
    "binary": (lambda _: b"# \xff\xfe\x00\n" * 9, "not a pentapod program", 1),
    "comment": (lambda d: d.replace(b"# rows", b"# these rows", 1), "cannot read this header line", 10),
    "other version": (header(b"program = 1", b"program = 2"), "unknown format version", 1),
    "version true": (header(b"program = 1", b"program = true"), "unknown format version", 1),
    "version with a point": (header(b"program = 1", b"program = 1.0"), "unknown format version", 1),
    "version in words": (header(b"program = 1", b'program = "1"'), "unknown format version", 1),
    "unknown key": (header(b"# rows", b"# spindle = 3\n# rows"), "spindle: unknown key in the header", 10),
    "capital key": (header(b"# rows", b"# Rows"), "cannot read this header line", 10),
    "table": (header(b"# rows", b"# [extra]\n# rows"), "cannot read this header line (got '# [extra]')", 10),
    "dotted key": (header(b"# rows", b"# machine.name = 3\n# rows"), "cannot read this header line", 10),
    "key in a table": (header(b"rows = 50", b"rows = {rows = 50}"), "rows: bad value", 10),
    "two values": (header(b"rows = 50", b"rows = 50, 51"), "cannot read this header line", 10),
    "two keys": (header(b"rows = 50", b"rows = 50, period_s = 2.0"), "cannot read this header line", 10),
    "key hidden in a comment": (header(b"rows = 50", b"rows = 50 # period_s = 2"), "cannot read this header line", 10),
    "comment only": (header(b"# rows", b"# # rows = 3\n# rows"), "cannot read this header line", 10),
    "blank header line": (header(b"# rows", b"#\n# rows"), "cannot read this header line", 10),
    "a stray bracket": (header(b"rows = 50", b"rows = 50], [2"), "cannot read this header line", 10),
    "other digits in the header": (header(b"rows = 50", "rows = ٥٠".encode()), "cannot read this header line", 10),
    "other digits in a row": (in_row(20, field(2, "٥٠٠.٠".encode())), "leg2_mm: not a finite number", 32),
    "other digits in a time": (in_row(20, field(0, "٠.٠٢".encode())), "time_s: not a finite number", 32),
    "time in finer digits": (in_row(20, field(0, b"0.0200000002")), "not a multiple of the period in 6 decimals", 32),
    "key lost": (edit(lambda lines: [x for x in lines if b"period_s" not in x]), "period_s: the header lacks", None),
    "key twice": (header(b"# rows", b"# period_s = 0.002\n# rows"), "twice", 10),
    "processor in numbers": (header(b"# rows", b"# processor = 3\n# rows"), "processor: bad value", 10),
    "period zero": (header(b"0.001", b"0.0"), "period_s: bad value", 6),
    "period nan": (header(b"0.001", b"nan"), "period_s: bad value", 6),
    "period text": (header(b"0.001", b'"1 ms"'), "period_s: bad value", 6),
    "interpolation": (header(b'"linear"', b'"quintic"'), "interpolation: bad value", 7),
    "component": (header(b'"++"', b'"+"'), "component: bad value", 8),
    "machine": (header(b'"desk"', b"7"), "machine: bad value", 3),
    "placement shape": (header(b", [0.0, 0.0, 0.0, 1.0]]", b"]"), "placement_mm: bad value", 9),
    "placement not rigid": (header(b"[0.0, 0.0, 0.0, 1.0]]", b"[0.0, 0.0, 0.1, 1.0]]"), "last row", 9),
    "rows not a count": (header(b"rows = 50", b"rows = 50.0"), "rows: bad value", 10),
    "columns renamed": (header(b"leg3_mm", b"leg3_m"), "wrong column names", 11),
    "header only": (lambda d: d[: d.index(b"time_s")], "wrong column names", 11),
    "header cut": (lambda d: d[: d.index(b"machine_digest")], "ends within the header", 4),
    "no rows": (lambda d: d[: d.index(b"0.000000")], "there are no rows", 12),
    "cut in a row": (lambda d: d[:-20], "ends within a row", 61),
    "cut in a number": (lambda d: d[:-3], "ends within a row", 61),
    "last newline lost": (lambda d: d[:-1], "ends within a row", 61),
    "cut after a row": (lambda d: d[: d[:-1].rindex(b"\n") + 1], "number of rows", 60),
    "row lost": (in_row(20, lambda row: []), "1 rows are missing", 32),
    "rows swapped": (edit(swapped), "1 rows are missing", 32),
    "row twice": (in_row(20, lambda row: [row, row]), "out of order", 33),
    "rows added": (lambda d: d + d.split(b"\n")[-2].replace(b"0.049", b"0.050") + b"\n", "number of rows", 62),
    "late start": (edit(lambda x: x[: line_of(x, 0)] + x[line_of(x, 1) :]), "not a multiple", 12),
    "time off": (in_row(20, field(0, b"0.020400")), "not a multiple of the period", 32),
    "nan": (in_row(20, field(3, b"nan")), "leg3_mm: not a finite number (got 'nan')", 32),
    "inf": (in_row(20, field(5, b"inf")), "leg5_mm: not a finite number", 32),
    "word": (in_row(20, field(2, b"abc")), "leg2_mm: not a finite number (got 'abc')", 32),
    "gap": (in_row(20, field(2, b"")), "leg2_mm: not a finite number", 32),
    "comma": (in_row(20, field(2, b"1,5")), "wrong number of columns (got 7)", 32),
    "column lost": (in_row(20, lambda r: [r.rsplit(b",", 1)[0]]), "wrong number of columns (got 5)", 32),
    "column lost everywhere": (
        edit(lambda x: x[: line_of(x, 0)] + [r.rsplit(b",", 1)[0] for r in x[line_of(x, 0) :]]),
        "wrong number of columns (got 5)",
        12,
    ),
    "blank row": (in_row(20, lambda row: [b"", row]), "wrong number of columns (got 1)", 32),
    "comment among rows": (in_row(20, lambda row: [b"# pause", row]), "wrong number of columns", 32),
    "negative leg": (in_row(20, field(1, b"-500.0")), "leg1_mm: a leg length that no machine has", 32),
    "giant leg": (in_row(20, field(1, b"1e300")), "leg1_mm: a leg length that no machine has", 32),
    "nul bytes": (lambda d: d[:1200] + b"\0" * 50 + d[1250:], "", None),
}


@pytest.mark.parametrize("kernels", ["never", "always"])
@pytest.mark.parametrize("name", BAD)
def test_corrupt_files_are_refused_by_name_and_place(tmp_path, name, kernels):
    corrupt, message, line = BAD[name]
    good = program(placement=RigidTransform(np.eye(3), [0.1, 0.2, 0.3]))
    path = write_csv(good, tmp_path / "program.csv")
    data = path.read_bytes()
    bad = corrupt(data)
    assert bad != data
    path.write_bytes(bad)
    with kernels_used(kernels), pytest.raises(ProgramError) as caught:
        read_csv(path)
    assert message in str(caught.value)
    assert "program.csv" in str(caught.value)
    assert "\n" not in str(caught.value)
    if line is not None:
        assert caught.value.line == line


@pytest.mark.parametrize("digits", [9, 12, 6])
def test_a_time_column_of_another_clock_is_refused(tmp_path, digits):
    """It runs fast by 1e-8: in finer digits that shows at once, in the usual ones as soon as one of them is another."""
    rows = 60_000 if digits == 6 else 2000
    path = write_csv(program(rows), tmp_path / "program.csv")
    lines = path.read_text(encoding="utf-8").splitlines()
    start = len(lines) - rows
    for k in range(rows):
        time, legs = lines[start + k].split(",", 1)
        lines[start + k] = f"{float(time) * (1.0 + 1e-8):.{digits}f},{legs}"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(ProgramError, match="the time is not a multiple of the period"):
        read_csv(path)


@settings(max_examples=150, deadline=None)
@given(st.integers(0, 3000), st.integers(0, 255), st.sampled_from(["set", "insert", "delete", "cut"]))
def test_no_damaged_byte_makes_a_traceback(tmp_path_factory, place, byte, how):
    """Either a ProgramError, or a program with as many rows as its header says."""
    path = write_csv(program(30), tmp_path_factory.mktemp("p") / "p.csv")
    data = path.read_bytes()
    place = min(place, len(data) - 1)
    middle = {"set": bytes([byte]), "insert": bytes([byte]) + data[place : place + 1], "delete": b"", "cut": b""}
    path.write_bytes(data[:place] + middle[how] + (b"" if how == "cut" else data[place + 1 :]))
    try:
        rows, file = len(read_csv(path).legs), path
    except ProgramError as error:
        rows, file = 30, error.file
    assert (rows, file) == (30, path)


@pytest.mark.parametrize("name", [name for name in BAD if name != "nul bytes"])
def test_blocks_of_little_more_than_a_row_find_the_same(tmp_path, monkeypatch, name):
    """Where the file is cut into blocks cannot be told from what is read, nor from what is refused."""
    monkeypatch.setattr("pentapod.program.csv_rows.BLOCK_BYTES", 137)
    good = program(placement=RigidTransform(np.eye(3), [0.1, 0.2, 0.3]))
    path = write_csv(good, tmp_path / "program.csv")
    same(good, read_csv(path))
    test_corrupt_files_are_refused_by_name_and_place(tmp_path, name, "always")


def test_a_header_that_promises_too_much_takes_no_memory(tmp_path):
    path = write_csv(program(), tmp_path / "program.csv")
    path.write_bytes(path.read_bytes().replace(b"rows = 50", b"rows = 50000000000000", 1))
    with pytest.raises(ProgramError, match="number of rows"):
        read_csv(path)


def test_missing_file_and_unwritable_folder(tmp_path):
    with pytest.raises(ProgramError, match="no such file"):
        read_csv(tmp_path / "nowhere.csv")
    with pytest.raises(ProgramError, match="directory"):
        read_csv(tmp_path)
    with pytest.raises(InputError, match="cannot be written"):
        write_csv(program(), tmp_path / "no" / "folder.csv")


def test_a_name_that_is_no_text_leaves_no_file(tmp_path):
    with pytest.raises(InputError):
        write_csv(program(provenance=Provenance("\ud800", "", "", "")), tmp_path / "p.csv")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_million_rows(tmp_path):
    before = program(1_000_000)
    same(before, read_csv(write_csv(before, tmp_path / "p.csv")))


CORNER = st.tuples(*[st.one_of(st.floats(-10.0, -1e-9), st.just(-INF))] * 3)


@settings(max_examples=60)
@given(first=st.integers(0, 10**9), count=st.integers(1, 10**6), low=CORNER, high=CORNER)
def test_a_piece_comes_back_bit_for_bit(tmp_path_factory, first, count, low, high):
    path = tmp_path_factory.mktemp("p") / "program.csv"
    piece = Piece(first, first + count, low, (-high[0], -high[1], -high[2]))
    write_csv(program(rows=2, provenance=Provenance("desk", "m", "j", "v", piece)), path)
    assert read_csv(path).provenance.piece == piece


def test_processor_and_libraries_come_back_and_older_files_lack_them(tmp_path):
    source = replace(SOURCE, processor="x86_64 znver4", libraries='python 3.12.1, numpy 2.4.0 "µ"')
    path = write_csv(program(provenance=source), tmp_path / "program.csv")
    assert '# processor = "x86_64 znver4"\n# libraries = "python' in path.read_text(encoding="utf-8")
    assert read_csv(path).provenance == source
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    older = [line for line in lines if not line.startswith(("# processor =", "# libraries ="))]
    path.write_text("".join(older), encoding="utf-8")
    assert read_csv(path).provenance == SOURCE


def test_what_is_left_out_comes_back(tmp_path):
    source = replace(SOURCE, left_out=((3, 9), (120, 122)))
    path = write_csv(program(provenance=source), tmp_path / "program.csv")
    assert "# left_out = [[3, 9], [120, 122]]\n" in path.read_text(encoding="utf-8")
    assert read_csv(path).provenance == source
    assert "left_out" not in write_csv(program(provenance=SOURCE), tmp_path / "whole.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize("bad", ["[]", "[[3]]", "[[9, 3]]", "[[3.0, 9]]", "[3, 9]", "[[3, 9], [8, 12]]", "[[-1, 2]]"])
def test_bad_pairs_of_what_is_left_out_are_named(tmp_path, bad):
    path = write_csv(program(provenance=replace(SOURCE, left_out=((3, 9),))), tmp_path / "program.csv")
    path.write_text(path.read_text(encoding="utf-8").replace("[[3, 9]]", bad), encoding="utf-8")
    with pytest.raises(ProgramError) as caught:
        read_csv(path)
    assert caught.value.key == "left_out"


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("# setup_waypoints = [2, 9]\n", "", "setup_waypoints"),
        ("[2, 9]", "[9, 2]", "setup_box_mm"),
        ("[2, 9]", "[2.0, 9]", "setup_waypoints"),
        ("[2, 9]", "2", "setup_waypoints"),
        ("[-inf, 0.0, -inf]", "[-inf, 0.0]", "setup_box_mm"),
        ("[-inf, 0.0, -inf]", "[nan, 0.0, -inf]", "setup_box_mm"),
        ("[-inf, 0.0, -inf]", '["x", 0.0, -inf]', "setup_box_mm"),
    ],
)
def test_bad_pieces_are_named(tmp_path, old, new, key):
    path = tmp_path / "program.csv"
    piece = Piece(2, 9, (-INF, 0.0, -INF), (INF, 0.5, INF))
    write_csv(program(rows=2, provenance=Provenance("desk", "m", "j", "v", piece)), path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ProgramError) as caught:
        read_csv(path)
    assert caught.value.key == key
