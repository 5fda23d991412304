"""The claims of a verdict by kind, each kind with the claim that comes nearest to its limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pentapod.report.words import number
from pentapod.verify.verdict.verdict import Certificate, NotJudged

KINDS = (
    "The path is followed",
    "The surface is made",
    "Nothing touches",
    "The machine keeps its limits",
    "Feeds and stops are as asked",
    "The files belong together",
)

_BY_BEGINNING = (
    (0, ("tip deviation", "axis deviation", "toolpath covered", "starts at the toolpath", "ends at the toolpath")),
    (0, ("every cut", "deflection")),
    (1, ("gouge", "surface left")),
    (2, ("clearance",)),
    (3, ("leg", "continuous leg", "base joint", "platform joint", "passive limb", "component kept", "guides")),
    (3, ("tip ", "axis ")),
    (
        4,
        (
            "feed", "rapid rate", "starts at rest", "ends at rest", "lowest feed", "no unasked stop", "exact stops",
            "dwells",
        ),
    ),
    (5, ("readable", "machine", "controller", "job", "placement", "component as asked", "process data")),
    (5, ("compensation as asked",)),
)  # fmt: skip
"""Kind of a claim by how its name begins; the first that fits."""

_CLEAR = " clear of "


@dataclass(frozen=True)
class Group:
    """The claims of a kind, those that fail first, and those that were not judged.

    nearest: words on the one nearest to its limit; share: of its limit that is used, where that is an upper one.
    """

    title: str
    claims: tuple[Certificate, ...]
    open_claims: tuple[NotJudged, ...]
    nearest: str
    share: float | None

    @property
    def passed(self) -> bool:
        """Whether all hold, and all were judged but those that the job waives."""
        return all(c.passed for c in self.claims) and all(n.waived for n in self.open_claims)


def kind_of(claim: str) -> int:
    """Return the kind of a claim by its name: an index into `KINDS`, their number for claims that others added."""
    name = claim.rsplit(": ", 1)[-1] if claim.startswith("set-up ") else claim
    if _CLEAR in name:
        return 2
    return next((kind for kind, starts in _BY_BEGINNING if name.startswith(starts)), len(KINDS))


def grouped(certificates: Sequence[Certificate], not_judged: Sequence[NotJudged]) -> list[Group]:
    """Return the kinds that have claims, those with failures first, and last the claims of other packages."""
    groups: list[Group] = []
    for kind, title in enumerate((*KINDS, "Further claims")):
        claims = sorted((c for c in certificates if kind_of(c.claim) == kind), key=lambda c: c.passed)
        unjudged = tuple(n for n in not_judged if kind_of(n.claim) == kind)
        if claims or unjudged:
            groups.append(Group(title, tuple(claims), unjudged, *_nearest(claims, unjudged)))
    return sorted(groups, key=lambda group: group.passed)


def used_share(claim: Certificate) -> float | None:
    """Return the share of what is allowed that is used, where there is an upper bound above zero."""
    if claim.value is None or claim.bound is None or not claim.passed or claim.bound <= 0.0 or claim.value < 0.0:
        return None
    share = claim.value / (claim.bound if claim.allowed is None else claim.allowed)
    return share if share <= 1.0 else None  # else it is a lower bound


def _nearest(claims: Sequence[Certificate], unjudged: Sequence[NotJudged]) -> tuple[str, float | None]:
    """Return words on the claim that is nearest to its limit, and the used share of an upper limit."""
    failed = [c for c in claims if not c.passed]
    if failed:
        more = f", and {len(failed) - 1} more" if len(failed) > 1 else ""
        return f"{_measured(failed[0])}{more}", None
    if waiting := [n for n in unjudged if not n.waived]:
        return f"{waiting[0].claim}: not judged", None
    shares = [(share, c) for c in claims if (share := used_share(c)) is not None and c.value]
    if shares:
        share, claim = max(shares, key=lambda pair: pair[0])
        return f"{claim.claim}: {_percent(share)} of what is allowed", share
    rooms = [c for c in claims if c.value is not None and c.bound is not None and c.unit == "mm" and c.value > c.bound]
    if rooms:
        claim = min(rooms, key=lambda c: abs((c.value or 0.0) - (c.bound or 0.0)))
        value, bound = number(claim.value, claim.unit), number(claim.bound, claim.unit)
        return f"{claim.claim}: {value}{f', at least {bound}' if claim.bound else ' to spare'}", None
    return f"{len(claims)} {'claim' if len(claims) == 1 else 'claims'}", None


def _percent(share: float) -> str:
    """Return a share below one, which is not written as 100 %."""
    return f"{100.0 * share:.0f} %" if share < 0.995 else f"{min(100.0 * share, 99.9):.1f} %"


def _measured(claim: Certificate) -> str:
    """Return a claim that fails, with its value and its bound."""
    if claim.value is None or claim.bound is None:
        return f"{claim.claim}: fails"
    return f"{claim.claim}: {number(claim.value, claim.unit)}, limit {number(claim.bound, claim.unit)}"
