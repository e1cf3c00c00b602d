"""What was found on where a machine without a model is nonlinear, and how it is said."""

from collections.abc import Sequence
from dataclasses import dataclass

from chladni.gap.calibration import MOST, NOTICED
from chladni.gap.comparison.outside_band import ProductsOutside


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSite:
    """One sensor, or the place between two, as a candidate.

    Attributes
    ----------
    names
        One sensor, or two.
    motion, interval
        Share of the change with level, every line alike, that a law of the motion there explains on lines which the
        fit hasn't seen, and its 95 % interval; below zero where it predicts worse than nothing.
    pattern
        Share that a force of any shape explains along the path which reciprocity gives.
    motion_rival, pattern_rival
        Whether it is the best by this share, or can't be told from it.
    """

    names: tuple[str, ...]
    motion: float
    interval: tuple[float, float]
    pattern: float
    motion_rival: bool
    pattern_rival: bool

    @property
    def label(self) -> str:
        """In words."""
        return f"between {self.names[0]} and {self.names[1]}" if len(self.names) > 1 else f"at {self.names[0]}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLocation:
    """Where a machine is nonlinear, by several levels and a modal model of the lowest.

    Attributes
    ----------
    force, level
        Name of the input and its RMS at each level, the lowest first.
    sites
        Best motion first; none where noise is all that changes with level.
    one_direction
        Share of the change along one direction a line: less than about 1 speaks for more than one place.
    odd, even
        Share on unseen lines that only odd functions of the best motion explain, and only even ones.
    outside
        What follows which motion above the excited band at the highest level; None where that can't be told.
    """

    force: str
    level: tuple[float, ...]
    sites: tuple[SensorSite, ...]
    one_direction: float
    odd: float
    even: float
    outside: ProductsOutside | None

    @property
    def rivals(self) -> tuple[SensorSite, ...]:
        """Sites that neither motion nor pattern rules out, best motion first; none where no motion is followed."""
        if not self.sites or self.sites[0].interval[0] <= 0:
            return ()
        return tuple(site for site in self.sites if site.motion_rival and site.pattern_rival)

    @property
    def located(self) -> SensorSite | None:
        """The one site whose motion is followed best beyond doubt, where its pattern is possible; else None."""
        alone = [site for site in self.sites if site.motion_rival]
        return alone[0] if len(alone) == 1 and self.rivals else None

    @property
    def parity(self) -> tuple[str, ...]:
        """``odd``, ``even`` or both, where told from nothing within the band or above it."""
        if self.located is None:
            return ()
        # What follows another motion above the band says nothing of this place.
        above = self.outside if self.outside is not None and self.outside.motion == self.located.names else None
        shares = {"odd": (self.odd, above.odd if above else 0.0), "even": (self.even, above.even if above else 0.0)}
        return tuple(kind for kind, found in shares.items() if max(found) >= NOTICED)

    def sentences(self) -> tuple[str, ...]:
        """Say it."""
        if not self.sites:
            return ("too little but noise changes with level, so no place is told; excite harder",)
        return (self._where(), self._motion(), self._pattern(), *self._parity())

    def _where(self) -> str:
        span = f"what changes from {self.level[0]:.3g} to {self.level[-1]:.3g} RMS of {self.force}"
        if self.located is not None:
            return f"{span} comes from a nonlinearity {self.located.label}{self._how_surely()}"
        add = "put sensors at both sides of the joints in question, or add a lower level"
        if self.rivals:
            return f"{span} is not located for certain: perhaps {_either(self.rivals)}; {add}"
        why = (
            "motion and pattern contradict each other"
            if self.sites[0].interval[0] > 0
            else "no motion of these sensors, or between two of them, predicts it"
        )
        return f"{span} is not located: {why}; the place may have no sensor; {add}"

    def _how_surely(self) -> str:
        if self.sites[0].motion >= MOST:
            return ""
        return (
            ", or next to it: a law of that motion explains less than half, so not all that moves there is measured"
        )

    def _motion(self) -> str:
        best = self.sites[0]
        share = (
            f"a law of the motion {best.label} explains {best.motion:.0%} ({best.interval[0]:.0%} to "
            f"{best.interval[1]:.0%}) of what changes, on lines that the fit has not seen"
        )
        near = [site for site in self.sites[1:] if site.motion_rival]
        if near:
            return f"{share}; the motion {_either(near)} is as good"
        beside = f"; next is the motion {self.sites[1].label} with {max(self.sites[1].motion, 0.0):.0%}"
        return f"{share}{beside if len(self.sites) > 1 else ''}"

    def _pattern(self) -> str:
        ranked = sorted(self.sites, key=lambda site: -site.pattern)
        could = [site for site in ranked if site.pattern_rival]
        out = [site for site in ranked if not site.pattern_rival]
        told = (
            f"{self.one_direction:.0%} of it lie along one direction a line, as of one place; by that pattern over "
            f"the sensors a force of any shape {_either(could)} explains {could[-1].pattern:.0%}"
        )
        upper = f" to {could[0].pattern:.0%}" if len(could) > 1 else ""
        excluded = f", one {_either(out)} at most {out[0].pattern:.0%}" if out else ""
        return f"{told}{upper}{excluded}"

    def _parity(self) -> tuple[str, ...]:
        if self.located is None:
            return ()
        inside = (
            f"{' and '.join(self.parity) or 'neither odd nor even for certain'}: within the band "
            f"{max(self.odd, 0.0):.0%} follow only odd functions of that motion, {max(self.even, 0.0):.0%} only even "
            "ones"
        )
        if self.outside is None:
            return (inside,)
        return (inside, f"at {self.level[-1]:.3g} RMS {self.outside.sentence()}")


def _either(sites: Sequence[SensorSite]) -> str:
    return " or ".join(site.label for site in sites)
