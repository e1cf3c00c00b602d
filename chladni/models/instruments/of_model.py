"""An instrument for any model, such as one from a file."""

from dataclasses import dataclass

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Instrument, Options, Values
from chladni.models.core.model import Model
from chladni.signals.errors import ModelError

REFERENCE = "reference"


def instrument_of(model: Model, *, title: str = "") -> Instrument:
    """Make an instrument of a model: a knob for each of its parameters, a step at its first input.

    Parameters
    ----------
    model
        Any model; its effects stay as they are.
    title
        For people; the model's name if empty.

    Raises
    ------
    ModelError
        When the model has no input or no output.
    """
    compiled = model.compile()
    for what, terminals in (("input", compiled.inputs), ("output", compiled.outputs)):
        if not terminals:
            raise ModelError(
                f"model {model.name!r} has no {what}, so there is nothing to show; give it an [[{what}]]"
            )
    # A motion that is prescribed acts with its derivatives: a step of it would have an infinite force.
    rational = not any(terminal.derivatives for terminal in compiled.inputs)
    return Instrument(
        name=model.name,
        title=title or model.name,
        parameters=model.parameters,
        build=_Build(model),
        step_input=_commanded(compiled),
        step_output=compiled.outputs[0].name,
        views=("step", "bode", "nyquist", "poles", "influence") if rational else ("bode", "nyquist"),
    )


def _commanded(compiled: CompiledModel) -> str:
    """Name of the input that a person turns: the reference of the outermost loop, else the first."""
    names = [terminal.name for terminal in compiled.inputs]
    return REFERENCE if REFERENCE in names else names[0]


@dataclass(frozen=True, slots=True)
class _Build:
    """Builds the model at other values; a record, so that an instrument can be sent to another process."""

    model: Model

    def __call__(self, values: Values, options: Options) -> Model:  # noqa: ARG002  # the instrument declares no option
        return self.model.with_values(values)
