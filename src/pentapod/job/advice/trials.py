"""Trials: changes of a job that fit by an estimate, those first that keep most of the task."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice, pairwise

import numpy as np

from pentapod.base.errors import InputError
from pentapod.base.units import from_si, to_si
from pentapod.job.advice.options import FEWEST, AdviceOptions, Tried
from pentapod.job.advice.parts import Regions, Smaller
from pentapod.job.advice.places import Place
from pentapod.job.advice.settings import LEFT_ALONE, Setting, Settings, Trial, joined, merged
from pentapod.job.build.values import job_machine
from pentapod.planning.estimate import Estimate
from pentapod.verify.claims.component import COMPONENT_KEPT

Because = Callable[[str], None]
"""Takes words for why nothing else is tried, or what stands in the way of all that was."""

Ended = Callable[[], Tried | None]
"""Returns how the last trial ended; None where there was none."""


@dataclass(frozen=True, eq=False)
class Trials:
    """The trials of one job, from estimates for its settings. placed: whether its own plan had a place for the part.

    otherwise: claims that failed in the other way in which a run planned it; LEFT_ALONE too where that is what failed
    in its own. meets: heights along the region's direction, metres, above which the tool or the spindle hardly touch
    the part or do not, where nothing else stood against its own plan, or that of another way.
    """

    settings: Settings
    because: Because
    ended: Ended
    placed: bool = False
    otherwise: frozenset[str] = frozenset()
    meets: tuple[float, ...] = ()

    @property
    def options(self) -> AdviceOptions:
        """How advice is searched for."""
        return self.settings.options

    def all(self, own: bool) -> Iterator[Trial]:
        """Yield the trials, the best first as far as that is known. own: whether the job as it is counts as one."""
        too_wide = self.settings.share_in_reach(self.settings.sketch) < 1.0
        if self.otherwise:  # it was planned with two kinds of tool axes already
            yield from self._higher(self.meets)
        if not too_wide:
            yield from self._keeping_all(own)
        if not (self.placed and self.otherwise == LEFT_ALONE):  # smaller regions are tried by what is left on them
            yield from self._others(own, too_wide=too_wide)

    def _others(self, own: bool, *, too_wide: bool) -> Iterator[Trial]:
        """Yield changes of more than tool axes and placement."""
        settings, bases = self.settings, self._bases()
        if short := settings.beyond_a_single_place():
            for base in bases[:1]:
                yield from self._lengths(base)
            limits = "; ".join(f"{each.constraint} by {each.shortfall:.3g} {each.unit}" for each in short[:2])
            self.because(f"no pose of the tool was found, whatever the part: {limits}; it is the machine, or the tool")
            return
        touching = next((setting for setting in settings.looked_at if setting.touches), None)
        if not too_wide:
            yield from self._scarcely(own)
        if not self.meets:
            yield from self._more_setups(bases)
        elif not self.otherwise:
            yield from self._higher(self.meets)
        for base in bases:
            yield from self._smaller(base)
        if touching is not None:
            yield from self._top(touching)
        if self.meets:  # in another place the tool meets the part again, unless it leans there
            yield from self._more_setups(bases)
        if bases:
            yield from self._scales(bases[0])
        nearest = touching or settings.nearest
        if nearest is not None and (short := nearest.found.shortfalls):
            words = nearest.words or "the job as it is"
            self.because(f"{words} came nearest: {short[0].constraint} by {short[0].shortfall:.3g} {short[0].unit}")

    def _keeping_all(self, own: bool) -> Iterator[Trial]:
        """Yield changes of tool axes and placement; the cheapest to plan first, once they fit comfortably."""
        for place in self.settings.places:
            for setting in islice(self._in_place(place, own), self.options.failures):
                yield from self._of_setting(setting)
                last = self.ended()
                if last is not None and last.meets:
                    yield from self._higher(last.meets[-1:], setting)
                if last is not None and last.failed and all(each.startswith(COMPONENT_KEPT) for each in last.failed):
                    break  # it is near a singular surface there, whatever the tool axes

    def _in_place(self, place: Place, own: bool) -> Iterator[Setting]:
        """Yield other tool axes with one placement; those that fit comfortably as soon as they are found."""
        scant: list[Setting] = []
        for axis in self.settings.of(place):
            setting = self.settings.setting(axis, place)
            if not (own or setting.words) or axis.words in self._failing or setting.found.margin < self.options.enough:
                continue
            if not self.settings.is_usual(setting):
                self.because(f"{setting.words}: it fits, but beside the work volume, where nobody builds a table")
                continue
            if setting.found.margin < self.options.comfortable:
                scant.append(setting)
            else:
                yield setting
        # Of about the same margin, those count that are cheap to plan.
        for setting in sorted(scant, key=lambda s: -round(s.found.margin, 2)):
            if setting.axis.words not in self._failing:
                yield setting

    def _of_setting(self, setting: Setting) -> Iterator[Trial]:
        yield Trial(setting.words, setting.changes, 1.0, 1.0)
        last = self.ended()
        if last is None or last.stage is None:
            return
        if last.stage != "placement":
            self._programmed.append(setting)
        # Axes that may lean do so in another way in another place.
        if last.failed == LEFT_ALONE or (last.meets and setting.found.samples.tilt == 0.0):
            self._failing.add(setting.axis.words)

    @cached_property
    def _programmed(self) -> list[Setting]:
        """The settings that had a place for the part in their plans, and failed later."""
        return []

    @cached_property
    def _failing(self) -> set[str]:
        """Words of tool axes with which too much is left, or the tool touches the part, wherever that is placed."""
        return {""} if self.otherwise == LEFT_ALONE else set()

    def _scarcely(self, own: bool) -> Iterator[Trial]:
        """Yield the best change of tool axes and placement that fits by its estimate, but hardly: a plan finds more."""
        scarce = [
            setting
            for setting in self.settings.looked_at
            if (own or setting.words)
            and setting.axis.words not in self._failing
            and self.options.scarcely <= setting.found.margin < self.options.enough
        ]
        for setting in sorted(scarce, key=lambda s: -s.found.margin)[:1]:
            yield from self._of_setting(setting)

    def _bases(self) -> list[Setting]:
        """Return the settings from which other changes start: the best one, and the job's own.

        Where the whole task is too wide for one set-up, the first one that fits for a box of it.
        """
        if (best := self.settings.nearest) is not None:
            own = self.settings.looked_at[0]
            return [own] if best is own else [best, own]
        regions = self._all_regions
        if regions is None:
            return []
        for share in self.options.cores:
            core = regions.boxed(share * self.settings.usual_share)
            if core is not None and (found := self.settings.first_that_fits(core.sketch)) is not None:
                return [found]
        return []

    @cached_property
    def _all_regions(self) -> Regions | None:
        settings = self.settings
        return Regions.of(settings.job, settings.mesh, settings.sketch.tool, settings.toolpath, self.options)

    def _smaller(self, base: Setting) -> Iterator[Trial]:
        """Yield changes that keep less, or need another tool."""
        regions = sorted(self._regions(base), key=lambda trial: -trial.worth)
        yield from (trial for trial in regions if trial.worth >= self.options.worth_length)
        yield from self._lengths(base)
        yield from (trial for trial in regions if trial.worth < self.options.worth_length)

    def _regions(self, base: Setting) -> list[Trial]:
        """Return the largest smaller regions that fit: flatter ones, and boxes."""
        regions = self._all_regions
        if regions is None:
            return []
        found: list[Smaller] = []
        self.settings.tell("a smaller region_angle_deg")
        near: Estimate | None = None
        for degrees in self.options.angles_deg:
            if (smaller := regions.flatter(degrees)) is None:
                continue
            near = self.settings.less(base, smaller.sketch, near)
            if near is None:
                break
            if self.settings.fits(near):
                found.append(smaller)
                break
        self.settings.tell("a smaller region_box_mm")
        for deep in (False, True):
            found += self._boxes(base, lambda share, deep=deep: regions.boxed(share, deep=deep))
        return [self._of_region(base, smaller) for smaller in found]

    def _higher(self, heights: tuple[float, ...], base: Setting | None = None) -> Iterator[Trial]:
        """Yield what is higher than the places where the tool or the spindle touch the part."""
        for height in heights:
            self.settings.tell("only what is higher")
            regions = self._all_regions
            if regions is not None and (smaller := regions.above(height + self.options.rise)) is not None:
                own = Trial(smaller.words, smaller.changes, smaller.share, smaller.share)
                yield own if base is None else self._of_region(base, smaller)

    def _top(self, base: Setting) -> Iterator[Trial]:
        """Yield the flat top of the part: shank or holder may have room there, where they touch the part elsewhere."""
        if (regions := self._all_regions) is not None:
            self.settings.tell("only what is flat at the top")
            for smaller in self._boxes(base, regions.top, self.options.shallow):
                yield self._of_region(base, smaller)

    def _of_region(self, base: Setting, smaller: Smaller) -> Trial:
        changes, words = merged(base.changes, smaller.changes), joined(smaller.words, base.words)
        return Trial(words, changes, smaller.share, smaller.share)

    def _boxes(
        self, base: Setting, boxed: Callable[[float], Smaller | None], first: float | None = None
    ) -> list[Smaller]:
        """Return about the largest box that fits, by bisection, and a smaller one, in case its plan fails."""

        def estimated(share: float, near: Estimate | None) -> Estimate | None:
            smaller = boxed(share)
            return None if smaller is None else self.settings.less(base, smaller.sketch, near)

        fits = self.settings.largest(estimated, first or self.options.first)
        if fits == 0.0:
            return []
        boxes = (boxed(factor * fits) for factor in (self.options.spare, self.options.smaller))
        return [box for box in boxes if box is not None]

    def _more_setups(self, bases: list[Setting]) -> Iterator[Trial]:
        """Yield more set-ups, for parts that have no place in one: a program that fails in one fails again."""
        for base in bases:
            programmed = base in self._programmed or base.axis.words in self._failing
            if not programmed and not (self.placed and not base.words):
                yield from self._setups(base)

    def _setups(self, base: Setting) -> Iterator[Trial]:
        """Yield the smallest number of set-ups whose slabs fit."""
        if not base.place.constraints.moves:
            return
        settings, contacts = self.settings, self.settings.sketch.contacts
        settings.tell("more placement.setups")
        for count in self.options.setups:
            for along in np.argsort(-np.ptp(contacts, axis=0))[:2].tolist():
                at = contacts[:, along]
                borders = pairwise(np.linspace(at.min(), at.max(), count + 1).tolist())
                parts = [settings.sketch.within(low, high, along) for low, high in borders]
                parts = [part for part in parts if len(part.contacts) >= FEWEST]
                fit = (settings.fits(settings.less(base, part)) for part in parts)
                if count > settings.job.placement.setups and all(fit):
                    changes = merged(base.changes, {"placement": {"setups": count}})
                    yield Trial(joined(f"up to {count} set-ups", base.words), changes, 1.0, 1.0)
                    return

    def _lengths(self, base: Setting) -> Iterator[Trial]:
        """Yield the first other tool length that fits, else the best one: with other tool axes, and by itself."""
        settings = self.settings
        if settings.share_in_reach(settings.sketch) < 1.0:
            return
        settings.tell("another tool.length_mm")
        best: tuple[float, float, Settings] = (-np.inf, 0.0, settings)
        for length in self._other_lengths():
            try:
                other = replace(settings, machine=settings.machine.with_tool(to_si(length, "mm")))
                found = other.less(base, settings.sketch)
            except InputError:  # the spindle or the holder would not fit
                continue
            if found is not None and found.margin > best[0]:
                best = found.margin, length, other
            if settings.fits(found):
                break
        margin, length, other = best
        words, keys, worth = f"a tool of {length:g} mm", {"tool": {"length_mm": length}}, self.options.worth_length
        if base.found.margin < margin < self.options.enough:
            settings_of = (other.setting(axis, base.place) for axis in other.of(base.place))
            usual = (each for each in settings_of if each.found.margin >= self.options.enough and other.is_usual(each))
            fits = next(usual, None)
            if fits is not None:
                yield Trial(joined(words, fits.words), merged(fits.changes, keys), 1.0, worth)
        if margin >= self.options.scarcely:
            yield Trial(joined(words, base.words), merged(base.changes, keys), 1.0, worth)

    def _other_lengths(self) -> list[float]:
        """Return lengths of the tool to try, mm; first that of the machine's file, where the job has another."""
        settings = self.settings
        lengths = [from_si(share * settings.machine.tool_length, "mm") for share in self.options.lengths]
        if settings.job.tool.length_mm is not None:
            lengths.insert(0, from_si(job_machine(settings.job.with_(tool={"length_mm": None})).tool_length, "mm"))
        return [float(round(float(each))) for each in lengths]

    def _scales(self, base: Setting) -> Iterator[Trial]:
        """Yield the largest scale that fits, by bisection; it makes another part."""
        settings = self.settings
        settings.tell("a smaller part.scale")

        def estimated(share: float, near: Estimate | None) -> Estimate | None:
            return settings.less(base, settings.sketch.scaled(share), near, obstacles=False)

        fits = settings.largest(estimated, 0.5)
        if fits > 0.0:
            size = self.options.spare * fits
            changes = merged(base.changes, {"part": {"scale": float(f"{size * settings.job.part.scale:.3g}")}})
            yield Trial(joined(f"the part at {size:.2g} of its size", base.words), changes, 1.0, 0.0, whole=False)
