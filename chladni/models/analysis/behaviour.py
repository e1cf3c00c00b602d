"""Behaviour of a system in numbers, in time and in frequency."""

from dataclasses import dataclass

from chladni.models.analysis.frequency_behaviour import FrequencyBehaviour, frequency_behaviour, frequency_quantities
from chladni.models.analysis.linear_path import LinearPath, System, linear_path
from chladni.models.analysis.step_behaviour import SETTLING_BAND, StepMarks, step_marks, step_quantities
from chladni.models.core.reading import Quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class Behaviour:
    """How one output answers one input, by exact linear equations.

    Attributes
    ----------
    path
        From the input to the output.
    step
        What happens when after a unit step.
    frequency
        What happens where in frequency.
    quantities
        Both in numbers; a quantity that doesn't exist here has the value None and says why.
    """

    path: LinearPath
    step: StepMarks
    frequency: FrequencyBehaviour
    quantities: tuple[Quantity, ...]

    def value(self, name: str) -> float | None:
        """Give the value of the named quantity."""
        return next(quantity.value for quantity in self.quantities if quantity.name == name)


def behaviour(
    system: System, *, from_input: str = "", to_output: str = "", size: float = 1.0, band: float = SETTLING_BAND
) -> Behaviour:
    """Compute behaviour in time and in frequency.

    Laws (friction, stops) are left out; a dead time inside a loop too, in what is read in time.

    Parameters
    ----------
    system
        State space, compiled model or model.
    from_input, to_output
        Names; the first of each when empty.
    size
        Of the step, in the input's unit.
    band
        Half the width of the settling band, over the final value.

    Raises
    ------
    ModelError
        For an unknown name, and an input whose derivatives act too.
    """
    path = linear_path(system, from_input=from_input)
    return path_behaviour(path.to(to_output or path.outputs[0].name), size=size, band=band)


def path_behaviour(path: LinearPath, *, size: float = 1.0, band: float = SETTLING_BAND) -> Behaviour:
    """Compute behaviour of a path to one output; see `behaviour`."""
    marks, found = step_marks(path, band=band), frequency_behaviour(path)
    return Behaviour(
        path=path,
        step=marks,
        frequency=found,
        quantities=(*step_quantities(path, marks, size=size, band=band), *frequency_quantities(path, found)),
    )
