"""Influence coefficients: how much each behaviour parameter changes with each construction parameter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from chladni.models.analysis.behaviour import Behaviour, behaviour
from chladni.models.analysis.difference import relative_derivative
from chladni.models.analysis.linear_path import LinearPath, compiled_model
from chladni.models.analysis.sensitivity import log_derivatives, tangent
from chladni.models.analysis.step_behaviour import SETTLING_BAND
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Instrument, Options, Values
from chladni.models.core.model import Model
from chladni.models.core.parameter import Parameter
from chladni.models.core.reading import InfluenceTable
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.renamed import renamed

#: The four of the paper's table 1.
PAPER_BEHAVIOUR = ("answer_time", "peak_acceleration", "resonance_frequency", "critical_frequency")
#: Those, and what else changes smoothly with construction.
BEHAVIOUR = (
    *PAPER_BEHAVIOUR,
    "rise_time",
    "overshoot",
    "settling_time",
    "damping_ratio",
    "peak_frequency",
    "bandwidth",
    "tracking_error",
)
CHANGE = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Strongest:
    """Cells that stand out in a table of influence.

    Attributes
    ----------
    of_rows
        Column of the behaviour parameter that each construction parameter acts on most; None where it acts on none.
    of_columns
        Row of the construction parameter that acts most on each behaviour parameter; likewise.
    """

    of_rows: tuple[int | None, ...]
    of_columns: tuple[int | None, ...]


@renamed(band="settling_band")
@in_one_thread()
def influence(
    system: Model | Instrument,
    values: Values | None = None,
    options: Options | None = None,
    *,
    parameters: Sequence[str] = (),
    behaviour_names: Sequence[str] = (),
    changes: float | Mapping[str, float] = CHANGE,
    from_input: str = "",
    to_output: str = "",
    settling_band: float = SETTLING_BAND,
) -> InfluenceTable:
    """Compute influence coefficients as the paper defines them (equation 3), and as logarithmic derivatives.

    ::

        C = R_PCD/R_PCF,   R = (initial - final)/initial          finite change
        S = d ln(behaviour)/d ln(construction)                    its limit for small changes

    Behaviour is that of the linear equations; laws are left out, and the definitions say so.

    Parameters
    ----------
    system
        Model, or instrument.
    values, options
        Setting, beside the defaults.
    parameters
        Which ones change; all that are construction when empty.
    behaviour_names
        Columns, names of quantities of `chladni.models.analysis.behaviour.behaviour`; when empty the paper's four and
        those of `BEHAVIOUR` that exist here.
    changes
        Relative change, final over initial less one: of each parameter, or by name (others: 0.1). Where it leads out
        of what is possible the change is made to the other side; where that is impossible too there is no finite
        coefficient.
    from_input, to_output
        Whose behaviour; the instrument's own, or the first of each when empty.
    settling_band
        Of settling.

    Returns
    -------
    InfluenceTable
        NaN where a behaviour parameter doesn't exist at one of the points, and the definition says why.

    Raises
    ------
    ModelError
        For an unknown name, a change to nothing or to minus something, and a dead time inside a loop.
    """
    model, source, output, size = _resolved(system, values, options, from_input, to_output)
    nominal = behaviour(model, from_input=source, to_output=output, size=size, band=settling_band)
    # Operating conditions (pressure, flow) are varied only when asked for: the table is about what is built.
    rows = [model.parameters.require(name) for name in parameters] or _construction(model)
    kept = _known(nominal, behaviour_names or _existing(nominal))
    study = _Study(model=model, nominal=nominal, names=kept, size=size, band=settling_band)
    applied = [_applied(row, changes) for row in rows]
    initial = study.values(nominal)
    relative = np.array([study.relative_change(row, one) for row, one in zip(rows, applied, strict=True)]) + 0.0
    # Plus zero: a coefficient of -0 would be printed as one that lowers.
    exact = np.array([study.log_derivatives(row) for row in rows]) + 0.0
    # R is (initial - final)/initial on both sides: a growth of 10 % is -0.1.
    change = -np.array(applied)
    return InfluenceTable(
        behaviour=kept,
        construction=tuple(row.name for row in rows),
        nominal=initial,
        change=change,
        relative_change=relative.reshape(len(rows), len(kept)),
        finite=relative.reshape(len(rows), len(kept)) / change[:, None] + 0.0,
        log_derivative=exact.reshape(len(rows), len(kept)),
        definitions=study.definitions(),
    )


def strongest(coefficients: Real) -> Strongest:
    """Find the largest magnitude of each row and column of ``[construction, behaviour]``, NaN and 0 left out."""
    sizes = np.nan_to_num(np.abs(coefficients), nan=0.0)
    return Strongest(of_rows=_largest(sizes), of_columns=_largest(sizes.T))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Study:
    """One operating point, and what is asked of it."""

    model: Model
    nominal: Behaviour
    names: tuple[str, ...]
    size: float
    band: float

    def values(self, found: Behaviour) -> Real:
        numbers = {quantity.name: quantity.value for quantity in found.quantities}
        return np.array([np.nan if numbers[name] is None else numbers[name] for name in self.names], dtype=np.float64)

    def definitions(self) -> tuple[str, ...]:
        words = {quantity.name: quantity.definition for quantity in self.nominal.quantities}
        compiled = compiled_model(self.model)
        linear = "" if isinstance(compiled, CompiledModel) and compiled.is_linear() else "; of the linear equations"
        return tuple(words[name] + linear for name in self.names)

    def relative_change(self, parameter: Parameter, change: float) -> Real:
        """R_PCD of each behaviour parameter."""
        if not np.isfinite(change):
            return np.full(len(self.names), np.nan)
        moved = self.model.with_values({parameter.name: parameter.value * (1 + change)})
        path = self.nominal.path
        found = behaviour(
            moved, from_input=path.source.name, to_output=path.outputs[0].name, size=self.size, band=self.band
        )
        initial = self.values(self.nominal)
        # An overshoot of 0 has no relative change.
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(initial == 0, np.nan, (initial - self.values(found)) / initial)

    def log_derivatives(self, parameter: Parameter) -> Real:
        path, count = self.nominal.path, self.nominal.path.b.size

        def equations(value: float) -> Real:
            return _equations(self.model.with_values({parameter.name: value}), path)

        change = relative_derivative(equations, parameter)
        moved = tangent(self.nominal, change[:, : count + 1], float(change[0, count + 1]))
        found = log_derivatives(self.nominal, moved, band=self.band)
        return np.array([found.get(name, np.nan) for name in self.names])


def _equations(model: Model, path: LinearPath) -> Real:
    """``[A b; c d]`` in the states of `path`, and a last column that begins with the dead time."""
    compiled = model.compile()
    state_space = compiled.state_space()
    # In the states of the nominal path, kept and scaled likewise: only then differences are derivatives.
    column, row = state_space.input_index(path.source.name), state_space.output_index(path.outputs[0].name)
    count, kept, scale = path.b.size, path.kept, path.scale
    matrix = np.zeros((count + 1, count + 2))
    matrix[:count, :count] = state_space.a[np.ix_(kept, kept)] * scale / scale[:, None]
    matrix[:count, count] = state_space.b[kept, column] / scale
    matrix[count, :count] = state_space.c[row, kept] * scale
    matrix[count, count] = state_space.d[row, column]
    matrix[0, count + 1] = compiled.input_delays_s[column] + compiled.output_offsets_s[row]
    return matrix


def _resolved(
    system: Model | Instrument, values: Values | None, options: Options | None, from_input: str, to_output: str
) -> tuple[Model, str, str, float]:
    """Model, input, output and size of the step."""
    if isinstance(system, Instrument):
        model = system.model(values, options)
        return model, from_input or system.step_input, to_output or system.step_output, system.step_size
    if options:
        raise ModelError("options belong to an instrument; give a model that has them already")
    return (system.with_values(values) if values else system), from_input, to_output, 1.0


def _construction(model: Model) -> list[Parameter]:
    found = [parameter for parameter in model.parameters.values() if parameter.role == "construction"]
    if not found:
        raise ModelError(f"{model.name}: no parameter is marked as construction; name those that change")
    return found


def _existing(nominal: Behaviour) -> list[str]:
    return [name for name in BEHAVIOUR if name in PAPER_BEHAVIOUR or nominal.value(name) is not None]


def _known(nominal: Behaviour, names: Sequence[str]) -> tuple[str, ...]:
    known = [quantity.name for quantity in nominal.quantities]
    for name in names:
        if name not in known:
            raise ModelError(f"no behaviour parameter {name!r}; there are: {', '.join(known)}")
    return tuple(names)


def _applied(parameter: Parameter, changes: float | Mapping[str, float]) -> float:
    """Relative change that is possible, NaN when none is."""
    wanted = changes if isinstance(changes, (int, float)) else changes.get(parameter.name, CHANGE)
    if not np.isfinite(wanted) or wanted == 0 or wanted <= -1:
        raise ModelError(f"{parameter.name}: a relative change of {wanted} is none; give a number above -1 but not 0")
    for change in (float(wanted), -float(wanted)):
        if parameter.value and parameter.minimum <= parameter.value * (1 + change) <= parameter.maximum:
            return change
    return np.nan


def _largest(sizes: Real) -> tuple[int | None, ...]:
    return tuple(int(np.argmax(row)) if row.size and row.max() > 0 else None for row in sizes)
