"""Proposed jobs that would not fit their machine are changed so that they do, by an estimate, and that is told."""

from __future__ import annotations

import tomllib

import pytest

from pentapod.job import AdviceOptions, Job
from pentapod.job.fitting import fitted
from pentapod.job.proposal import Proposal
from pentapod.machine import Machine
from refused_jobs import REFUSED


def proposal(folder, name, **changes) -> tuple[Proposal, dict]:
    tables = tomllib.loads(REFUSED[name].write(folder).read_text(encoding="utf-8"))
    for table, keys in changes.items():
        tables[table] = {**tables[table], **keys}
    mesh = {"mesh": tables["part"].pop("mesh")}
    return Proposal(tables, {}, ("as it was",)), mesh


@pytest.fixture(scope="module")
def desk():
    return Machine.load("desk")


def test_a_job_that_fits_stays_as_it_is(desk, tmp_path):
    proposed, mesh = proposal(tmp_path, "table too low", placement={"table_z_mm": 480.0})
    assert fitted(proposed, mesh, tmp_path, desk) is proposed


def test_a_table_that_is_too_low_is_raised(desk, tmp_path):
    proposed, mesh = proposal(tmp_path, "table too low")
    found = fitted(proposed, mesh, tmp_path, desk)
    assert 300.0 < found.tables["placement"]["table_z_mm"] < 600.0
    assert proposed.tables["placement"]["table_z_mm"] == 900.0
    assert found.remarks[0] == "as it was"
    assert "does not fit the machine like this; so: another height of the table" in found.remarks[1]
    assert "does not fit" in found.reasons["placement", "table_z_mm"]
    Job.from_dict({**found.tables, "part": {**mesh, **found.tables["part"]}}, tmp_path)


def test_where_nothing_fits_that_is_said(desk, tmp_path):
    """Two metres of toolpath in one piece: no height of the table, and no axis, helps."""
    proposed, mesh = proposal(tmp_path, "toolpath from a file, too far", part={"scale": 40.0})
    quick = AdviceOptions(angles_deg=(), setups=(), lengths=(), cones_deg=())
    found = fitted(proposed, mesh, tmp_path, desk, quick)
    assert found.tables == proposed.tables
    assert "`pentapod plan` says why" in found.remarks[-1]
