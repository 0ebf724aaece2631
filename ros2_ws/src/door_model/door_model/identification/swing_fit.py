"""What is fitted to which swings of a recording, and what is to be said of it."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum

from door_model.checks import require_not_negative
from door_model.door.closer import FourBarCloser
from door_model.errors import DoorParameterError, NoFitError, NoSwingError
from door_model.identification.odd_swings import CommonFit, fit_common, said_of
from door_model.identification.parameters import ratio_bounds
from door_model.identification.trajectory_fit import EXTRAS, OPENING, SWING, RatioFit, fit_ratios
from door_model.recording.checks import zero_doubts
from door_model.recording.recording import Recording
from door_model.recording.swings import MIN_PEAK, Found, FreeSwing

_WORSE = 1.3  # closing is left out where it raises the residuals by more than this factor
_BETTER = 0.7  # share of the residuals that something beyond the paper must leave
_GOOD = 2.5  # grains; a fit this good hides no odd swing
_SUSPICIOUS = 1.5  # grains
_AT_BOUND = 1e-3  # of a bound
_SHOWS = 1.02  # residuals without a zone, over those with it
_POOR = 2.0  # grains
_MOST_LEFT = 0.05  # of the largest angle
_ZONES = ("latch", "backcheck")
_ZONE_UNKNOWNS = frozenset(name for zone in _ZONES for name in EXTRAS[zone])
_CLOSING_DIFFERS = (
    "closing does not follow eq. (1) with one viscosity: only opening was fitted, as in the paper, "
    "which leaves c_c less certain")
_WRONG_LINKAGE = (
    "are the linkage's lengths those of this door, and the counts a turn those of the encoder?")


class Window(Enum):
    """Which part of a swing is fitted."""

    AUTO = "auto"  # opening and closing; opening alone where closing does not follow eq. (1)
    OPENING = "opening"  # to the peak, as in the paper
    SWING = "swing"  # opening and closing


@dataclass(frozen=True)
class _Step:
    """An extra that was added to a fit."""

    extra: str
    free: tuple[str, ...]  # what is then fitted
    zones: dict[str, float]  # what is then known of zones
    rmse: float  # [rad]


@dataclass(frozen=True)
class SwingFit:
    """How swings are to be fitted.

    Attributes:
        linkage: The linkage.
        window: Which part of them.
        extras: What to fit beyond the paper, of `EXTRAS`.
        zero_std: Of the encoder's zero [rad].
        grain: Residuals that the right model leaves [rad].

    Raises:
        DoorParameterError: There is no such extra, or zero_std is negative.
    """

    linkage: FourBarCloser
    window: Window
    extras: Sequence[str]
    zero_std: float
    grain: float

    def __post_init__(self) -> None:
        """Check the names."""
        for name in self.extras:
            if name not in EXTRAS or list(self.extras).count(name) > 1:
                raise DoorParameterError("an extra", name, f"of {', '.join(EXTRAS)}, each once")
        require_not_negative("zero_std", self.zero_std)

    def run(self, swings: Sequence[FreeSwing]) -> tuple[CommonFit, list[str]]:
        """Fit what was asked for; opening alone where closing does not follow the model.

        Returns:
            The fit and what to say of it.

        Raises:
            NoFitError: As `fit_ratios`, or the fit leaves far too much of the swings.
        """
        common, said = self._chosen(swings)
        return common, [*said, *self._misfit(common.fit, common.swings)]

    def _misfit(self, fit: RatioFit, swings: Sequence[FreeSwing]) -> list[str]:
        """What to say of what a fit leaves; NoFitError where that is far too much."""
        rmse = fit.rmse
        largest = _MOST_LEFT * max(float(swing.theta.max()) for swing in swings)
        if rmse > largest:
            raise NoFitError(
                f"the swings do not follow eq. (1): the best fit leaves {math.degrees(rmse):.2f} "
                f"deg, at most {math.degrees(largest):.2f} deg would do; {_WRONG_LINKAGE}",
                value=rmse,
                limit=largest,
            )
        if not self.grain or rmse <= _POOR * self.grain:
            return []
        return [
            f"the fit leaves {math.degrees(rmse):.4f} deg, {rmse / self.grain:.1f} times what the "
            f"encoder explains, so that standard deviations say little; {_WRONG_LINKAGE}"
        ]

    def _chosen(self, swings: Sequence[FreeSwing]) -> tuple[CommonFit, list[str]]:
        """Fit of opening and closing, or of opening alone."""
        if self.window is Window.OPENING:
            return self._opening(swings)
        if not any(len(swing.t) - swing.peak_index > len(swing.t) // 4 for swing in swings):
            common, said = self._opening(swings)
            return common, ["no swing falls shut by itself: only opening was fitted", *said]
        both = None
        try:
            both, said = self._with_closing(swings)
        except NoFitError:
            if self.window is Window.SWING:
                raise
        if both is not None:
            hint = self._missing(both)
            if self.window is Window.SWING or both.fit.rmse <= _GOOD * self.grain:
                return both, [*said, *hint]
        opening, said_of_opening = self._opening(swings)
        if both is not None:
            if both.fit.rmse <= _WORSE * max(opening.fit.rmse, self.zero_std):
                return both, [*said, *hint]
            said_of_opening += hint
        return opening, [_CLOSING_DIFFERS, *said_of_opening]

    def within(
        self, common: CommonFit, bounds: Mapping[str, tuple[float, float]], i_a: float
    ) -> tuple[RatioFit, list[str]]:
        """The fit again, within bounds of the parameters in SI units.

        Raises:
            DoorParameterError: A bound is of what is not fitted, or no interval.
            NoFitError: As `run`.
        """
        free = common.fit.asked
        ratios = ratio_bounds(bounds, i_a)
        for name, ratio in zip(bounds, ratios, strict=True):
            if ratio not in free:
                raise DoorParameterError("the parameter of a bound", name, "one that is fitted")
        fit = fit_ratios(
            self.linkage, common.swings, free, zero_std=self.zero_std, bounds=ratios,
            first=dict(zip(common.fit.free, common.fit.values, strict=True)))
        said = []
        for name, (ratio, (low, high)) in zip(bounds, ratios.items(), strict=True):
            value = fit.value(ratio)
            if any(edge and abs(value - edge) < _AT_BOUND * abs(edge) for edge in (low, high)):
                said.append(f"{name} lies at its bound: the swings ask for one beyond it")
        return fit, [*said, *self._misfit(fit, common.swings)]

    def _opening(self, swings: Sequence[FreeSwing]) -> tuple[CommonFit, list[str]]:
        """Fit of opening alone."""
        common = fit_common(
            self.linkage, swings, OPENING, zero_std=self.zero_std, good_rmse=self._good)
        unasked = [f"{name} was not identified: it takes the fall shut too" for name in self.extras]
        return common, [*said_of(common.left_out), *unasked]

    def _with_closing(self, swings: Sequence[FreeSwing]) -> tuple[CommonFit, list[str]]:
        """Fit of opening and closing with those zones that show in the swings."""
        zones = [name for name in _ZONES if name in self.extras]
        start = (*SWING, *(EXTRAS["friction"] if "friction" in self.extras else ()))
        grown = list(self._grow(swings, start, zones))
        free, first = (grown[-1].free, grown[-1].zones) if grown else (start, {})
        common = fit_common(
            self.linkage, swings, free, zero_std=self.zero_std, good_rmse=self._good, first=first)
        said = said_of(common.left_out)
        for zone in zones:
            without = tuple(name for name in common.fit.asked if name not in EXTRAS[zone])
            plain = fit_ratios(
                self.linkage, common.swings, without, zero_std=self.zero_std,
                first={name: first[name] for name in without if name in first})
            if plain.rmse < _SHOWS * common.fit.rmse:
                common = replace(common, fit=plain)
                said.append(f"no {zone} shows in the swings: it was left out")
        return self._looked_elsewhere(common), said

    def _looked_elsewhere(self, common: CommonFit) -> CommonFit:
        """The fit with each of several zones looked for again, now that the others are known."""
        zones = [zone for zone in _ZONES if EXTRAS[zone][0] in common.fit.free]
        rivals = dict(common.fit.rivals)
        for zone in zones if len(zones) > 1 else ():
            others = {name: value for name, value in _known_zones(common.fit).items()
                      if name not in EXTRAS[zone]}
            fit = fit_ratios(
                self.linkage, common.swings, common.fit.asked, zero_std=self.zero_std,
                first=others)
            rivals |= fit.rivals
            if fit.rmse < common.fit.rmse:
                common = replace(common, fit=fit)
        return replace(common, fit=replace(common.fit, rivals=rivals))

    @property
    def _good(self) -> float:
        """Residuals [rad] of a fit that hides no odd swing."""
        return _GOOD * self.grain

    def _grow(
        self,
        swings: Sequence[FreeSwing],
        free: tuple[str, ...],
        extras: Sequence[str],
        first: Mapping[str, float] | None = None,
    ) -> Iterator["_Step"]:
        """Add extras one after the other, each time the one that explains most."""
        left, known = list(extras), dict(first or {})
        while left:
            fits = {}
            for name in left:
                with suppress(NoFitError):
                    fits[name] = fit_ratios(
                        self.linkage, swings, (*free, *EXTRAS[name]), zero_std=self.zero_std,
                        first=known)
            if not fits:
                return
            best = min(fits, key=lambda name: fits[name].rmse)
            fit = fits[best]
            free = (*free, *EXTRAS[best])
            known = _known_zones(fit)
            left.remove(best)
            yield _Step(best, free, known, fit.rmse)

    def _missing(self, common: CommonFit) -> list[str]:
        """Say what else the swings ask for, if something beyond the paper explains far more."""
        rmse = common.fit.rmse
        if rmse <= _SUSPICIOUS * self.grain:
            return []
        asked, least = [], rmse
        others = [name for name in EXTRAS if name not in self.extras]
        for step in self._grow(
            common.swings, common.fit.asked, others, _known_zones(common.fit)
        ):
            if step.rmse > _BETTER * least:
                break
            asked.append(step.extra)
            least = step.rmse
            if least <= _SUSPICIOUS * self.grain:
                break
        if not asked:
            return []
        names = " and ".join(sorted(asked, key=list(EXTRAS).index))
        return [
            f"with {names} identified too the residuals would fall from "
            f"{math.degrees(rmse):.4f} to {math.degrees(least):.4f} deg: do so"
        ]


def _known_zones(fit: RatioFit) -> dict[str, float]:
    """What a fit found of zones, by name."""
    return {name: float(value) for name, value in zip(fit.free, fit.values, strict=True)
            if name in _ZONE_UNKNOWNS}


def usable_swings(
    recording: Recording, linkage: FourBarCloser, found: Found
) -> tuple[list[FreeSwing], list[str]]:
    """The free swings that stay where the linkage closes and that nothing stopped.

    Args:
        recording: What they were found in.
        linkage: The linkage.
        found: What was found in it.

    Returns:
        The swings and what to say of the others.

    Raises:
        NoSwingError: None is left.
    """
    lowest, limit = linkage.closing_limit(), linkage.opening_limit()
    usable, said = [], zero_doubts(recording)
    for swing in found.swings:
        low, top = float(swing.theta.min()), float(swing.theta.max())
        if swing.stopped:
            reason = f"it hit something at {math.degrees(top):.1f} deg"
        elif not (lowest < low and top < limit):
            reason = (
                f"it goes from {math.degrees(low):.1f} to {math.degrees(top):.1f} deg, the linkage "
                f"from {math.degrees(lowest):.1f} to {math.degrees(limit):.1f} deg")
        else:
            usable.append(swing)
            continue
        said.append(f"the swing at {swing.t[0]:.1f} s was left out: {reason}")
    said += [
        f"the swing with its top at {time:.1f} s was left out: it does not begin at the shut door"
        for time in found.other_tops
    ]
    if usable:
        return usable, said
    if not len(recording.t):
        raise NoSwingError("the recording is empty", limit=MIN_PEAK)
    highest = float(recording.theta.max())
    raise NoSwingError(
        "; ".join([
            f"no free swing above {math.degrees(MIN_PEAK):.0f} deg in "
            f"{recording.t[-1] - recording.t[0]:.1f} s of recording (largest angle "
            f"{math.degrees(highest):.2f} deg): push the shut door once, let go, and wait until it "
            "has fallen shut", *said]),
        value=highest,
        limit=MIN_PEAK,
    )
