"""A virtual instrument: parameters to turn, options to switch, and the model they make."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from chladni.models.core.model import Model
from chladni.models.core.parameter import Parameters
from chladni.models.core.reading import Chart
from chladni.signals.errors import ModelError

Values = Mapping[str, float]
Options = Mapping[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """A choice between words; a switch is a choice between ``off`` and ``on``."""

    name: str
    choices: tuple[str, ...] = ("off", "on")
    default: str = "off"
    meaning: str = ""

    def __post_init__(self) -> None:
        if self.default not in self.choices:
            raise ModelError(f"option {self.name!r}: {self.default!r} is none of {', '.join(self.choices)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Instrument:
    """Declares one virtual instrument; a page, a notebook and a table are made from it.

    Attributes
    ----------
    name
        Word on the command line, such as ``pneumatic-motor``.
    title
        For people.
    parameters
        Knobs, with units and ranges.
    build
        ``build(values, options) -> Model`` from every parameter's value (SI) and every option's word.
    options
        Load, correction, kind of element, ...
    step_input, step_output
        Input that steps, and output whose behaviour is told, when the user doesn't choose.
    step_size
        Size of the step, in the input's unit.
    load_input
        Input that carries the load, or empty.
    load_size
        Size of the load's step, in the load's unit; a load that the drive is built for shows what one unit hides.
    extra_charts
        Charts of its own (the loops of a damper), from the model; None when it needs none.
    extra_titles
        Name and title of each of them, so that a page can offer them without computing them; they are always
        computed when empty.
    views
        Charts that make sense: ``step``, ``bode``, ``nyquist``, ``poles``, ``root-locus``, ``influence``.
    """

    name: str
    title: str
    parameters: Parameters
    build: Callable[[Values, Options], Model]
    options: tuple[Option, ...] = ()
    step_input: str = ""
    step_output: str = ""
    step_size: float = 1.0
    load_input: str = ""
    load_size: float = 1.0
    extra_charts: Callable[[Model], tuple[Chart, ...]] | None = None
    extra_titles: tuple[tuple[str, str], ...] = ()
    views: tuple[str, ...] = ("step", "bode", "nyquist", "poles", "influence")

    def model(self, values: Values | None = None, options: Options | None = None) -> Model:
        """Build the model at some setting; what isn't given has its default.

        Raises
        ------
        ModelError
            When a parameter or option is unknown, or a value impossible.
        """
        chosen = {option.name: option.default for option in self.options}
        for name, word in (options or {}).items():
            known = next((option for option in self.options if option.name == name), None)
            if known is None or word not in known.choices:
                allowed = ", ".join(chosen) if known is None else ", ".join(known.choices)
                raise ModelError(f"{self.name}: option {name} = {word!r} is not known; there are: {allowed}")
            chosen[name] = word
        return self.build(self.parameters.with_values(values or {}).numbers(), chosen)
