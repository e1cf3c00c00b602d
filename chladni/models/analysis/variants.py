"""Variants of a setting: each a few parameters or options that differ, compared under their names."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from chladni.models.core.instrument import Option
from chladni.models.core.parameter import Parameters
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """A setting that is shown beside others.

    Attributes
    ----------
    name
        Label of its curves.
    values
        Parameters that differ from the defaults, SI.
    options
        Options that differ from the defaults.
    """

    name: str
    values: Mapping[str, float] = field(default_factory=dict)
    options: Mapping[str, str] = field(default_factory=dict)


def one_at_a_time(parameters: Parameters, name: str, values: Sequence[float]) -> tuple[Variant, ...]:
    """Make a variant for each value of one parameter, labelled by it.

    Raises
    ------
    ModelError
        For an unknown parameter and an impossible value.

    Examples
    --------
    >>> from chladni.models.core.parameter import Parameter
    >>> mass = Parameters((Parameter(name="mass", value=1.0, unit="kg", low=0.5, high=2.0, minimum=0.0),))
    >>> [variant.name for variant in one_at_a_time(mass, "mass", [1.0, 2.0])]
    ['mass = 1 kg', 'mass = 2 kg']
    """
    unit = parameters.require(name).unit
    suffix = "" if unit == "1" else f" {unit}"
    for value in values:
        parameters.require(name).with_value(value)
    return tuple(Variant(name=f"{name} = {value:g}{suffix}", values={name: float(value)}) for value in values)


def require_possible(variant: Variant, parameters: Parameters, options: Sequence[Option]) -> None:
    """Raise `ModelError` when a variant names an unknown parameter or option, or gives an impossible value."""
    parameters.with_values(variant.values)
    known = {option.name: option.choices for option in options}
    for name, word in variant.options.items():
        if word not in known.get(name, ()):
            allowed = known.get(name) or tuple(known)
            raise ModelError(f"option {name} = {word!r} is not known; there are: {', '.join(allowed) or 'none'}")
