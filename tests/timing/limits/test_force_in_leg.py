"""A limit of one's own: force in a leg, with the payload's weight as an offset, from the law to the verdict."""

from dataclasses import dataclass

import numpy as np
import pytest
from timing_paths import Path, Piece, by_tip, line, machine, nodding, raster

from pentapod.base.refusal import Refusal
from pentapod.cli.commands.new import dome_stl
from pentapod.geometry.interpolant import Interpolant
from pentapod.job import Job, run
from pentapod.timing import AccelerationRows, Explanation, Limit, Trajectory, certify, explain, override, retime
from pentapod.verify import Claim
from pentapod.verify.replay.claim import Finding
from usual_job import job_text

GRAVITY = 9.81


@dataclass(frozen=True, eq=False)
class ForceInLeg(Limit):
    """|mass q̈ + weight (tip's height over the base, metres)| ≤ most, in newtons: linear in s̈ and ṡ², with an offset."""

    quantity = "force in leg"
    group = "acceleration"
    of_legs = True

    mass: float
    payload: float
    most: float
    legs: int = 5

    @property
    def names(self):
        return tuple(f"force in leg {k + 1}" for k in range(self.legs))

    def weight(self, tips, lengths):
        """What the payload's weight asks of each leg (n, legs), newtons: by how steep it stands."""
        return self.payload * GRAVITY * tips[:, 2:] / lengths

    def acceleration_rows(self, path):
        tips, lengths = path.piece.pose(path.s)[0], path.piece(path.s, 0)
        first, second = (self.mass * y / self.most for y in path.legs[:2])
        return AccelerationRows(first, second, self.weight(tips, lengths) / self.most)

    def judge(self, replay):
        """The claim: from the program's rows and the replayed poses alone."""
        program, (position, direction) = replay.program, replay.pose
        legs = Interpolant.through(program.legs, program.period, program.interpolation)
        tips = (position + replay.machine.tool_length * direction)[::2]
        forces = np.abs(self.mass * legs.second + self.weight(tips, program.legs))
        row, leg = np.unravel_index(int(forces.argmax()), forces.shape)
        worst = float(forces[row, leg])
        return Finding(worst <= self.most, worst, self.most, "N", replay.place(2 * int(row)), f"leg {leg + 1}")


def forces(limit, trajectory, t):
    tips, _ = trajectory.pose(t)
    return limit.mass * trajectory(t, 2) + limit.weight(tips, trajectory(t))


def timed(path, m, **options):
    result = retime(path, m, **options)
    assert isinstance(result, Trajectory), str(result)
    return result


PATHS = {
    "raster": lambda: raster(lines=3, feed=0.3),
    "nod": lambda: Piece(by_tip(line(), nodding()), 0.05, 0.2, inner_knots=tuple(np.linspace(0, 0.05, 52)[1:-1])),
}


@pytest.mark.parametrize(
    ("name", "jerk", "interpolation"),
    [("raster", True, "cubic"), ("nod", True, "linear"), ("nod", False, "linear"), ("raster", False, "cubic")],
)
def test_a_force_in_legs_holds_and_is_named(name, jerk, interpolation):
    """At rest the weight takes up to 0.88 of the limit; recomputed from the trajectory, and from its setpoints."""
    limit, m, path = ForceInLeg(2.0, 1.0, 15.0), machine(interpolation=interpolation), Path((PATHS[name](),))
    assert np.abs(limit.weight(path.pieces[0].pose(np.zeros(1))[0], path.pieces[0](np.zeros(1)))).max() > 9.0
    free, kept = timed(path, m, limit_jerk=jerk), timed(path, m, limit_jerk=jerk, limits=(limit,))
    t = np.linspace(0.0, kept.duration, 20_001)
    assert np.abs(forces(limit, free, np.linspace(0.0, free.duration, 20_001))).max() > 1.1 * limit.most
    assert 0.98 * limit.most < np.abs(forces(limit, kept, t)).max() <= limit.most * 1.0001
    assert kept.duration > free.duration
    rows = np.arange(round(kept.duration / 1e-3) + 1) * 1e-3
    joined = Interpolant.through(kept(rows), 1e-3, interpolation).second
    pushes = limit.mass * joined + limit.weight(kept.pose(rows)[0], kept(rows))
    assert np.abs(pushes).max() <= limit.most * 1.0005
    story = explain(kept, m, certify(kept, m))
    assert any(cause.name.startswith("force in leg") for cause in story.causes)
    (use,) = (use for use in story.uses if use.quantity == "force in leg")
    assert 0.97 < use.share <= 1.001
    assert use.leg in range(1, 6)


def test_limit_with_an_offset_by_both_engines_agrees():
    path, limit = Path((PATHS["nod"](),)), ForceInLeg(2.0, 1.0, 15.0)
    ours, theirs = (
        timed(path, machine(), limit_jerk=False, limits=(limit,), engine=engine).duration
        for engine in ("core", "toppra")
    )
    assert ours == pytest.approx(theirs, rel=1e-5, abs=1.01e-3)


def test_a_force_that_the_weight_alone_exceeds_is_refused():
    limit = ForceInLeg(2.0, 1.6, 15.0)
    result = retime(Path((PATHS["nod"](),)), machine(), limits=(limit,))
    assert isinstance(result, Refusal)
    assert "a limit is exceeded even at rest there: 1.41 times the limit" in result.cause
    assert "force in leg" in result.cause
    assert result.diagnosis[0].constraint.startswith("force in leg")


@pytest.mark.slow
def test_an_override_keeps_a_limit_that_was_added():
    limit, m = ForceInLeg(2.0, 1.0, 15.0), machine(interpolation="cubic")
    trajectory = timed(Path((PATHS["raster"](),)), m, limits=(limit,))
    for share in (0.0, 0.5, 1.5):
        turned = override(trajectory, m, 0.3, share)
        assert isinstance(turned, Trajectory), str(turned)
        t = np.linspace(0.0, turned.duration, 20_001)
        assert np.abs(forces(limit, turned, t)).max() <= limit.most * 1.001


@pytest.fixture
def planned(tmp_path):
    """Plan the usual job with a limit, and judge it by another: the outcome, and the limit's certificate."""
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=12))
    (tmp_path / "job.toml").write_text(job_text(), encoding="utf-8")
    job = Job.load(tmp_path / "job.toml")

    def planned(limit, claim):
        outcome = run(job, tmp_path / "out", limits=(limit,), claims=(Claim("force in leg", claim.judge),))
        return outcome, {c.claim: c for c in outcome.verdict.certificates}["force in leg"]

    return planned


LOOSE, TIGHT = ForceInLeg(2.0, 1.0, 1e3), ForceInLeg(2.0, 1.0, 16.0)


def test_job_with_an_added_limit_is_timed_explained_and_judged(planned):
    outcome, certificate = planned(TIGHT, TIGHT)
    assert outcome.passed, str(outcome.verdict)
    assert 0.95 * TIGHT.most < certificate.value <= TIGHT.most
    assert any(cause.name.startswith("force in leg") for cause in outcome.find(Explanation).causes)
    assert "force in leg" in str(outcome.find(Explanation))


@pytest.mark.slow
def test_job_that_does_not_keep_a_limit_that_is_judged_fails(planned):
    outcome, certificate = planned(LOOSE, TIGHT)
    assert not outcome.passed
    assert not certificate.passed
