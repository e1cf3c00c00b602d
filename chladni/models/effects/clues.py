"""Clues: what a diagnosis must know of an effect, to look for it and to tell it from others."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chladni.models.core.parameter import Parameters
from chladni.models.effects.lattice import Lattice
from chladni.models.effects.trial import Numbers, Trial, TrialMotion
from chladni.signals.arrays import Real

if TYPE_CHECKING:
    from chladni.models.effects.effect_kind import EffectKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Relative:
    """A form of another effect that does nearly the same; `effect` is a word or a record, as for `attached`."""

    effect: "str | EffectKind"
    values: Numbers
    variant: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedForm:
    """Where a fit of an effect to a log ended.

    Attributes
    ----------
    variant, values
        Form of the law and its numbers.
    duration_s
        Of the log.
    band_hz
        In which the machine moved.
    motion
        ``motion()`` gives ``[sample]`` displacement and velocity that the law saw; `ModelError` where it saw none.
    """

    variant: str
    values: Numbers
    duration_s: float
    band_hz: tuple[float, float]
    motion: Callable[[], tuple[Real, Real]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Clues:
    """What a diagnosis must know of an effect; all of it may be left out.

    Attributes
    ----------
    trials
        ``trials(motion)`` gives the forms to weigh at a site. By default each variant's law goes along the motion,
        on a grid over the usual range of its numbers.
    is_degenerate
        ``is_degenerate(fitted)`` says whether a fit ended where the effect does what a parameter or another effect
        does: a yield that is never reached is a spring.
    details
        Names of numbers that shape the law without naming it: fitted only when that pays.
    sizes
        Names of numbers that make the effect larger: a search that lets it grow begins with a small share of them.
    exact
        Whether the law has no details that a machine's could differ in: a factor, a shift of time, a mass.
    several
        Whether one machine part is often several of them at one site: a cable has more modes than one.
    is_loop
        Whether the force remembers: where a function of displacement and velocity explains as much, it's another.
    between_linked
        Whether it may also act between two bodies that share a joint: there a spring is none that a model lacks.
    timed
        Whether it happens at a time of its own, so that only the whole log shows it.
    nested
        ``nested(fitted)`` gives forms of other effects that contain it or that it contains, begun where it ended.
    resisting
        ``resisting(force, speed)`` gives values with which it resists with a force at every speed well above one: of
        a joint that sticks nothing but that can be told.
    doubts
        ``doubts(site, values, modelled)`` gives sentences on numbers that rather another mistake has; `modelled` are
        the model's parameters.
    possible
        ``possible(recorded, values)`` says whether an output that errs so may have recorded these samples.
    of_constant
        Whether it's a constant of an output, which every fit leaves free. No fit weighs it then.
    in_samples
        ``in_samples(signal)`` finds it in the samples of an output themselves. No fit weighs it then.
    of_force
        ``of_force(force, sample_rate_hz)`` gives its numbers from its force ``[sample]``, which follows nothing that
        a model knows; nothing where the force isn't one of its kind. No law is looked for then.
    """

    trials: Callable[[TrialMotion], Iterable[Trial]] | None = None
    is_degenerate: Callable[[FittedForm], bool] | None = None
    details: tuple[str, ...] = ()
    sizes: tuple[str, ...] = ()
    exact: bool = False
    several: bool = False
    is_loop: bool = False
    between_linked: bool = False
    timed: bool = False
    nested: Callable[[FittedForm], Iterable[Relative]] | None = None
    resisting: Callable[[float, float], Numbers] | None = None
    doubts: Callable[[str, Numbers, Parameters], Iterable[str]] | None = None
    possible: Callable[[Real, Numbers], bool] | None = None
    of_constant: bool = False
    in_samples: Callable[[Real], Lattice | None] | None = None
    of_force: Callable[[Real, float], Numbers] | None = None
