"""Choice of what is fitted to which swings of a recording, with warnings about the result."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from door_model.checks import require_not_negative
from door_model.door.closer import FourBarCloser
from door_model.errors import BadRecordingError, DoorParameterError, NoFitError, NoSwingError
from door_model.identification.odd_swings import CHANGED, CommonFit, fit_common, warnings_about
from door_model.identification.parameters import ratio_bounds
from door_model.identification.trajectory_fit import EXTRAS, OPENING, SWING, RatioFit, fit_ratios
from door_model.recording.checks import missing_rows, standing, zero_doubts
from door_model.recording.recording import Recording
from door_model.recording.swings import MIN_PEAK, FoundSwings, FreeSwing

# Residuals are compared with the grain: the residuals that the right model leaves.
_WORSE = 1.3  # closing is left out if it raises the residuals by more than this factor
_BETTER = 0.7  # an extra is recommended if it lowers the residuals below this share
_GOOD = 2.5  # up to this many grains no odd swing is looked for
_SUSPICIOUS = 1.5  # from this many grains a missing extra is looked for
_AT_BOUND = 1e-3  # a value is at its bound within this share of the bound
_SHOWS = 1.02  # a zone is kept if the residuals without it are larger by this factor
_POOR = 2.0  # from this many grains there is a warning
_MOST_LEFT = 0.05  # largest residuals of an accepted fit / largest angle
_ZONES = ("latch", "backcheck")
_ZONE_UNKNOWNS = frozenset(name for zone in _ZONES for name in EXTRAS[zone])
_CLOSING_DIFFERS = (
    "closing does not follow eq. (1) with one viscosity: only opening was fitted, as in the paper, "
    "so c_c is less certain")
_NOT_MODELLED = (
    "no friction, latch or backcheck explains the closing: a delayed action, a second latch zone "
    "and trapped air are not modelled")
_WRONG_LINKAGE = (
    "check the lengths of the linkage, the encoder's counts per turn, and that nobody changed the "
    "closer between the swings")


class Window(Enum):
    """Part of a swing that is fitted."""

    AUTO = "auto"  # opening and closing, or opening alone if closing does not follow eq. (1)
    OPENING = "opening"  # up to the peak, as in the paper
    SWING = "swing"  # opening and closing


@dataclass(frozen=True)
class _AddedExtra:
    """An extra that was added to a fit.

    Attributes:
        extra: Name of the extra.
        free: Names of the unknowns that are fitted with it.
        zones: Fitted unknowns of all zones by name.
        rmse: Root mean square of the residuals of this fit [rad].
    """

    extra: str
    free: tuple[str, ...]
    zones: dict[str, float]
    rmse: float


@dataclass(frozen=True)
class FitTask:
    """A description of how swings are fitted, and the fit itself.

    Attributes:
        linkage: The closer's linkage.
        window: Part of the swings that is fitted.
        extras: Names of what is fitted beyond the paper, out of `EXTRAS`.
        zero_std: Standard deviation of the encoder's zero [rad].
        grain: Residuals that the right model leaves [rad].

    Raises:
        DoorParameterError: An extra is unknown or given twice, or zero_std is negative.
    """

    linkage: FourBarCloser
    window: Window
    extras: Sequence[str]
    zero_std: float
    grain: float

    def __post_init__(self) -> None:
        """Check names and number."""
        for name in self.extras:
            if name not in EXTRAS or list(self.extras).count(name) > 1:
                raise DoorParameterError("an extra", name, f"of {', '.join(EXTRAS)}, each once")
        require_not_negative("zero_std", self.zero_std)

    def run(self, swings: Sequence[FreeSwing]) -> tuple[CommonFit, list[str]]:
        """Fit the swings; only their opening if closing does not follow the model.

        Returns:
            The fit and warnings about it.

        Raises:
            NoFitError: The swings cannot be fitted, or the residuals are far too large.
        """
        common, warnings = self._chosen(swings)
        return common, [*warnings, *self._misfit(common.fit, common.swings)]

    def _misfit(self, fit: RatioFit, swings: Sequence[FreeSwing]) -> list[str]:
        """Return a warning if the residuals are large.

        Raises:
            NoFitError: The residuals are far too large.
        """
        rmse = fit.rmse
        largest = _MOST_LEFT * max(float(swing.theta.max()) for swing in swings)
        if rmse > largest:
            raise NoFitError(
                f"the swings do not follow eq. (1): the residuals of the best fit are "
                f"{math.degrees(rmse):.2f} deg, must be at most {math.degrees(largest):.2f} deg; "
                f"{_WRONG_LINKAGE}",
                quantity="root mean square of the residuals [rad]",
                value=rmse,
                limit=largest,
            )
        if not self.grain or rmse <= _POOR * self.grain:
            return []
        return [
            f"the residuals of the fit are {math.degrees(rmse):.4f} deg, {rmse / self.grain:.1f} "
            f"times what the encoder explains, so the standard deviations are unreliable; "
            f"{_WRONG_LINKAGE}"
        ]

    def _chosen(self, swings: Sequence[FreeSwing]) -> tuple[CommonFit, list[str]]:
        """Fit opening and closing, or opening alone, as the window and the swings require."""
        if self.window is Window.OPENING:
            return self._opening(swings)
        if not any(len(swing.t) - swing.peak_index > len(swing.t) // 4 for swing in swings):
            common, warnings = self._opening(swings)
            return common, ["no swing falls shut by itself: only opening was fitted", *warnings]
        both = None
        try:
            both, warnings = self._with_closing(swings)
        except NoFitError as error:
            if self.window is Window.SWING or error.reason == CHANGED:
                raise
        if both is not None and (
            self.window is Window.SWING or both.fit.rmse <= _GOOD * self.grain):
            return both, [*warnings, *self._missing(both, math.inf)]
        opening, warnings_of_opening = self._opening(swings)
        hint = [_NOT_MODELLED]
        if both is not None:
            accepted = max(_WORSE * max(opening.fit.rmse, self.zero_std), _GOOD * self.grain)
            if both.fit.rmse <= accepted:
                return both, [*warnings, *self._missing(both, math.inf)]
            hint = self._missing(both, accepted) or hint
        return opening, [_CLOSING_DIFFERS, *warnings_of_opening, *hint]

    def within(
        self, common: CommonFit, bounds: Mapping[str, tuple[float, float]], i_a: float
    ) -> tuple[RatioFit, list[str]]:
        """Repeat a fit within bounds of the parameters.

        Args:
            common: The fit without bounds.
            bounds: Lower and upper bounds by the parameter's name, in SI units.
            i_a: Moment of inertia of the leaf [kg m^2].

        Returns:
            The new fit, and warnings about values at their bounds.

        Raises:
            DoorParameterError: A bound belongs to a parameter that is not fitted, or is no
                interval.
            NoFitError: The swings cannot be fitted, or the residuals are far too large.
        """
        free = common.fit.asked
        ratios = ratio_bounds(bounds, i_a)
        for name, ratio in zip(bounds, ratios, strict=True):
            if ratio not in free:
                raise DoorParameterError("the parameter of a bound", name, "one that is fitted")
        fit = fit_ratios(
            self.linkage, common.swings, free, zero_std=self.zero_std, bounds=ratios,
            first=dict(zip(common.fit.free, common.fit.values, strict=True)))
        warnings = []
        for name, (ratio, (low, high)) in zip(bounds, ratios.items(), strict=True):
            value = fit.value(ratio)
            if any(edge and abs(value - edge) < _AT_BOUND * abs(edge) for edge in (low, high)):
                warnings.append(f"{name} is at its bound: the swings fit best beyond it")
        return fit, [*warnings, *self._misfit(fit, common.swings)]

    def _opening(self, swings: Sequence[FreeSwing]) -> tuple[CommonFit, list[str]]:
        """Fit opening alone."""
        common = fit_common(
            self.linkage, swings, OPENING, zero_std=self.zero_std, good_rmse=self._good)
        unasked = [f"{name} was not identified: this needs closing, too" for name in self.extras]
        return common, [*warnings_about(common.left_out), *unasked]

    def _with_closing(self, swings: Sequence[FreeSwing]) -> tuple[CommonFit, list[str]]:
        """Fit opening and closing, with the wanted zones that have an effect on the swings."""
        zones = [name for name in _ZONES if name in self.extras]
        start = (*SWING, *(EXTRAS["friction"] if "friction" in self.extras else ()))
        grown = list(self._grow(swings, start, zones))
        free, first = (grown[-1].free, grown[-1].zones) if grown else (start, {})
        common = fit_common(
            self.linkage, swings, free, zero_std=self.zero_std, good_rmse=self._good, first=first)
        warnings = warnings_about(common.left_out)
        for zone in zones:
            without = tuple(name for name in common.fit.asked if name not in EXTRAS[zone])
            plain = fit_ratios(
                self.linkage, common.swings, without, zero_std=self.zero_std,
                first={name: first[name] for name in without if name in first})
            if plain.rmse < _SHOWS * common.fit.rmse:
                common = replace(common, fit=plain)
                warnings.append(f"the {zone} has no effect on the swings: it was left out")
        return self._with_zones_searched_again(common), warnings

    def _with_zones_searched_again(self, common: CommonFit) -> CommonFit:
        """Search for each of several zones again, now that the other zones are known."""
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
        """Residuals [rad] up to which no odd swing is looked for."""
        return _GOOD * self.grain

    def _grow(
        self, swings: Sequence[FreeSwing], free: tuple[str, ...], extras: Sequence[str],
        first: Mapping[str, float] | None = None
    ) -> Iterator[_AddedExtra]:
        """Add extras one after the other, each time the one that lowers the residuals most."""
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
            yield _AddedExtra(best, free, known, fit.rmse)

    def _missing(self, common: CommonFit, most: float) -> list[str]:
        """Return a recommendation if extras that were not wanted would lower the residuals much.

        Args:
            common: The fit without them.
            most: Largest residuals with which a fit with them is accepted [rad].
        """
        rmse = common.fit.rmse
        if rmse <= _SUSPICIOUS * self.grain:
            return []
        asked, least = [], rmse
        others = [name for name in EXTRAS if name not in self.extras]
        for step in self._grow(common.swings, common.fit.asked, others, _known_zones(common.fit)):
            if step.rmse > _BETTER * least:
                break
            asked.append(step.extra)
            least = step.rmse
            if least <= _SUSPICIOUS * self.grain:
                break
        if not asked or least > most:
            return []
        names = " and ".join(sorted(asked, key=list(EXTRAS).index))
        return [
            f"if {names} were identified, too, the residuals would fall from "
            f"{math.degrees(rmse):.4f} to {math.degrees(least):.4f} deg: this is recommended"
        ]


def _known_zones(fit: RatioFit) -> dict[str, float]:
    """Return the fitted unknowns of all zones by name."""
    return {name: float(value) for name, value in zip(fit.free, fit.values, strict=True)
            if name in _ZONE_UNKNOWNS}


def usable_swings(
    recording: Recording, linkage: FourBarCloser, found: FoundSwings
) -> tuple[list[FreeSwing], list[str]]:
    """Choose the free swings that nothing stopped and that the linkage can follow.

    Args:
        recording: The recording.
        linkage: The closer's linkage.
        found: The swings of the recording.

    Returns:
        The usable swings, and warnings about the others.

    Raises:
        NoSwingError: No swing is usable.
        BadRecordingError: Rows are missing in more than one swing, or in the only one.
    """
    lowest, limit = linkage.closing_limit(), linkage.opening_limit()
    held, leaps = standing(recording)[0], missing_rows(recording)
    usable, warnings = [], zero_doubts(recording)
    warnings += [f"the door was held open at {hold}" for hold in held]
    gaps = 0
    for swing in found.swings:
        low, top = float(swing.theta.min()), float(swing.theta.max())
        begin, end = float(swing.t[0]), float(swing.t[-1])
        inside = leaps[(recording.t[leaps] >= begin) & (recording.t[leaps] < end)]
        if any(hold.start < end and begin < hold.end for hold in held):
            reason = "the door was held then"
        elif inside.size:
            reason = _missing_rows(recording, inside)
            gaps += 1
        elif swing.stopped:
            reason = f"it hit something at {math.degrees(top):.1f} deg"
        elif not (lowest < low and top < limit):
            reason = (
                f"it moves from {math.degrees(low):.1f} to {math.degrees(top):.1f} deg, the "
                f"linkage closes from {math.degrees(lowest):.1f} to {math.degrees(limit):.1f} deg"
            )
        else:
            usable.append(swing)
            continue
        warnings.append(f"the swing at {begin:.1f} s was left out: {reason}")
    if gaps > 1 or gaps == len(found.swings) > 0:  # the others may lack rows where it was slow
        raise BadRecordingError(
            "the recording", None, _missing_rows(recording, leaps), value=len(leaps), limit=0)
    warnings += [
        f"the swing with its top at {time:.1f} s was left out: it does not begin at the shut door"
        for time in found.other_tops
    ]
    if usable:
        return usable, warnings
    if not len(recording.t):
        raise NoSwingError(
            "the recording is empty", quantity="number of samples", value=0, limit=1)
    highest = float(recording.theta.max())
    problem = "none of the swings can be used" if found.swings else (
        f"no free swing above {math.degrees(MIN_PEAK):.0f} deg in "
        f"{recording.t[-1] - recording.t[0]:.1f} s of recording (largest angle "
        f"{math.degrees(highest):.2f} deg): push the shut door once, let go, and wait until it "
        "has fallen shut; check the counts per turn, and that angles are in degrees")
    raise NoSwingError(
        "; ".join([problem, *warnings]), quantity="largest angle [rad]", value=highest,
        limit=MIN_PEAK)


def _missing_rows(recording: Recording, leaps: NDArray[np.intp]) -> str:
    """Return a sentence on rows that are missing behind some samples."""
    at = int(leaps[0])
    leap = math.degrees(float(recording.theta[at + 1] - recording.theta[at]))
    return (
        f"rows are missing, and their times were numbered anew: the angle leaps {len(leaps)} "
        f"time(s) from one row to the next, first by {leap:.2f} deg at {recording.t[at]:.3f} s")
