"""What is fitted to which swings of a recording, and what is to be said of it."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum

from door_model.checks import require_not_negative
from door_model.closer import FourBarCloser
from door_model.errors import DoorParameterError, NoFitError, NoSwingError
from door_model.odd_swings import CommonFit, fit_common, said_of
from door_model.parameters import ratio_bounds
from door_model.recordings import Recording
from door_model.swings import MIN_PEAK, FreeSwing
from door_model.trajectory_fit import EXTRAS, OPENING, SWING, RatioFit, fit_ratios

_WORSE = 1.3  # closing is left out where it raises the residuals by more than this factor
_BETTER = 0.7  # share of the residuals that something beyond the paper must leave
_GOOD = 0.5  # counts; a fit this good hides no odd swing
_SUSPICIOUS = 0.3  # counts; quantisation alone leaves 0.2
_AT_BOUND = 1e-3  # of the way between two bounds


class Window(Enum):
    """Which part of a swing is fitted."""

    AUTO = "auto"  # opening and closing; opening alone where closing does not follow eq. (1)
    OPENING = "opening"  # to the peak, as in the paper
    SWING = "swing"  # opening and closing


@dataclass(frozen=True)
class SwingFit:
    """How swings are to be fitted.

    Attributes:
        linkage: The linkage.
        window: Which part of them.
        extras: What to fit beyond the paper, of `EXTRAS`.
        zero_std: Of the encoder's zero [rad].
        resolution: Angle of a count [rad]; 0 where it is not known.

    Raises:
        DoorParameterError: There is no such extra, or zero_std is negative.
    """

    linkage: FourBarCloser
    window: Window
    extras: Sequence[str]
    zero_std: float
    resolution: float

    def __post_init__(self) -> None:
        """Check the names."""
        for name in self.extras:
            if name not in EXTRAS:
                raise DoorParameterError("an extra", name, f"of {', '.join(EXTRAS)}")
        require_not_negative("zero_std", self.zero_std)

    @property
    def free(self) -> tuple[str, ...]:
        """What is fitted where opening and closing are."""
        return (*SWING, *(name for extra in self.extras for name in EXTRAS[extra]))

    def run(self, swings: Sequence[FreeSwing]) -> tuple[CommonFit, list[str]]:
        """Fit what was asked for; opening alone where closing does not follow the model.

        Returns:
            The fit and what to say of it.

        Raises:
            NoFitError: As `fit_ratios`.
        """
        if self.window is Window.OPENING:
            return self._opening(swings, [])
        if not any(len(swing.t) - swing.peak_index > len(swing.t) // 4 for swing in swings):
            return self._opening(
                swings, ["no swing falls shut by itself: only opening was fitted"])
        both = None
        try:
            both = self._common(swings, self.free)
        except NoFitError:
            if self.window is Window.SWING:
                raise
        if both is None or not (
            self.window is Window.SWING or both.fit.rmse <= _GOOD * self.resolution
        ):
            opening, said = self._opening(swings, [])
            if both is None or both.fit.rmse > _WORSE * max(opening.fit.rmse, self.zero_std):
                return opening, [*said, *_CLOSING_DIFFERS, *self._missing(opening)]
        return both, [*said_of(both.left_out), *self._missing(both)]

    def within(
        self, common: CommonFit, bounds: Mapping[str, tuple[float, float]], i_a: float
    ) -> tuple[RatioFit, list[str]]:
        """The fit again, within bounds of the parameters in SI units.

        Raises:
            DoorParameterError: A bound is of what is not fitted, or no interval.
        """
        free = tuple(name for name in common.fit.free if name != "zero")
        ratios = ratio_bounds(bounds, i_a)
        for name, ratio in zip(bounds, ratios, strict=True):
            if ratio not in free:
                raise DoorParameterError("the parameter of a bound", name, "one that is fitted")
        fit = fit_ratios(
            self.linkage, common.swings, free, zero_std=self.zero_std, bounds=ratios,
            first=dict(zip(common.fit.free, common.fit.values, strict=True)))
        said = []
        for name, (ratio, (low, high)) in zip(bounds, ratios.items(), strict=True):
            value = fit.values[fit.free.index(ratio)]
            if min(value - low, high - value) < _AT_BOUND * (high - low):
                said.append(f"{name} lies at its bound: the swings ask for one beyond it")
        return fit, said

    def _common(self, swings: Sequence[FreeSwing], free: tuple[str, ...]) -> CommonFit:
        """Fit of the swings that agree."""
        return fit_common(
            self.linkage, swings, free, zero_std=self.zero_std,
            good_rmse=_GOOD * self.resolution)

    def _opening(
        self, swings: Sequence[FreeSwing], said: list[str]
    ) -> tuple[CommonFit, list[str]]:
        """Fit of opening alone."""
        common = self._common(swings, OPENING)
        return common, [*said, *said_of(common.left_out)]

    def _missing(self, common: CommonFit) -> list[str]:
        """Say what else the swings ask for, if something beyond the paper explains far more."""
        rmse = common.fit.rmse
        if rmse <= _SUSPICIOUS * self.resolution:
            return []
        fits = {}
        for name, own in EXTRAS.items():
            if name not in self.extras:
                with suppress(NoFitError):
                    fits[name] = fit_ratios(
                        self.linkage, common.swings, (*self.free, *own), zero_std=self.zero_std)
        best = min(fits, key=lambda name: fits[name].rmse, default=None)
        if best is None or fits[best].rmse > _BETTER * rmse:
            return []
        return [
            f"with {best} identified too the residuals would fall from {math.degrees(rmse):.4f} "
            f"to {math.degrees(fits[best].rmse):.4f} deg: do so"
        ]


_CLOSING_DIFFERS = (
    "closing does not follow eq. (1) with one viscosity: only opening was fitted, as in the paper, "
    "which leaves c_c less certain",
)


def usable_swings(
    recording: Recording, linkage: FourBarCloser, swings: Sequence[FreeSwing]
) -> tuple[list[FreeSwing], list[str]]:
    """The free swings that stay where the linkage closes and that nothing stopped.

    Args:
        recording: What they were found in.
        linkage: The linkage.
        swings: The swings.

    Returns:
        The swings and what to say of the others.

    Raises:
        NoSwingError: None is left.
    """
    lowest, limit = linkage.closing_limit(), linkage.opening_limit()
    usable, said = [], []
    for swing in swings:
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
