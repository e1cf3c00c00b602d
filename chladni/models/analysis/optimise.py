"""Best values of a few parameters for a wish about behaviour."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, differential_evolution, minimize

from chladni.models.analysis.behaviour import path_behaviour
from chladni.models.analysis.linear_path import LinearPath, linear_path
from chladni.models.analysis.wish import Wish, measured
from chladni.models.core.instrument import Instrument
from chladni.models.core.model import Model
from chladni.models.core.parameter import Parameters
from chladni.models.core.reading import Quantity
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError
from chladni.signals.linear_algebra import in_one_thread

BoundsByName = Mapping[str, tuple[float, float]]

# A candidate that breaks a limit costs more than any that doesn't, and one that has no such behaviour still more.
BROKEN, IMPOSSIBLE = 1e3, 1e6
# A value this near to its bound, over the bounds' distance, is held by it.
AT_BOUND = 1e-3
# Candidates a parameter, and rounds.
POPULATION, GENERATIONS = 8, 40
LIMIT_SLACK = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimum:
    """Best values found, and what they change.

    Attributes
    ----------
    wishes
        In words.
    initial, values
        Of each parameter that was free, SI.
    wished_before, wished_after
        The quantities that the wishes are about.
    before, after
        All behaviour quantities.
    met
        Whether every limit is kept and every quantity wished about exists.
    advice
        Sentences: which bound holds a value, why a wish can't be met.
    model
        With the best values.
    """

    wishes: tuple[str, ...]
    initial: Mapping[str, float]
    values: Mapping[str, float]
    wished_before: tuple[Quantity, ...]
    wished_after: tuple[Quantity, ...]
    before: tuple[Quantity, ...]
    after: tuple[Quantity, ...]
    met: bool
    advice: tuple[str, ...]
    model: Model


@in_one_thread()
def optimise(
    system: Model | Instrument,
    parameters: Sequence[str],
    wish: Wish | Sequence[Wish],
    *,
    bounds: BoundsByName | None = None,
    from_input: str = "",
    to_output: str = "",
    size: float | None = None,
    seed: int = 0,
) -> Optimum:
    """Find values of a few parameters that fulfil a wish, by the linear equations.

    Of several wishes one may be an aim, the others are limits that it's subject to. Limits alone are met with the
    least change of the parameters, each over its bounds. Differential evolution (Storn & Price 1997) finds the
    valley, a simplex its bottom; the same seed gives the same result.

    Parameters
    ----------
    system
        Where to begin: a model, or an instrument at its defaults.
    parameters
        Which are free.
    wish
        One or several.
    bounds
        Low and high by name, SI; others have their usual range.
    from_input, to_output
        Whose behaviour; the instrument's own, or a model's first of each, when empty.
    size
        Of the step; the instrument's own, or 1, when None.
    seed
        Of the search.

    Returns
    -------
    Optimum
        With `met` false and a sentence of advice when the wish can't be met inside the bounds.

    Raises
    ------
    ModelError
        For unknown names, bounds that leave nothing free or what is possible, and more than one aim.
    """
    wishes = (wish,) if isinstance(wish, Wish) else tuple(wish)
    if isinstance(system, Instrument):
        model = system.model()
        from_input, to_output = from_input or system.step_input, to_output or system.step_output
        size = system.step_size if size is None else size
    else:
        model = system
    size = 1.0 if size is None else size
    search = _Search(model, tuple(parameters), wishes, bounds or {}, from_input, to_output, size)
    # The model is asked anew for the result: what is told is what the values give, not what the search noted.
    values = search.best(seed)
    return search.told(values)


class _Search:
    def __init__(
        self,
        model: Model,
        names: tuple[str, ...],
        wishes: tuple[Wish, ...],
        bounds: BoundsByName,
        from_input: str,
        to_output: str,
        size: float,
    ) -> None:
        aims = [wish for wish in wishes if wish.limit is None]
        if not wishes or len(aims) > 1 or not names:
            raise ModelError("give at least one free parameter, one wish, and no more than one of them an aim")
        self._model, self._names, self._wishes, self._size = model, names, wishes, size
        self._aim = aims[0] if aims else None
        paths = linear_path(model, from_input=from_input, to_outputs=(to_output,) if to_output else ())
        self._ends = paths.source.name, paths.outputs[0].name
        self._bounds = _checked_bounds(model.parameters, names, bounds)
        self._initial = np.array([model.parameters[name].value for name in names])
        self._scale = self._measure(self._initial, self._aim) if self._aim else None

    def best(self, seed: int) -> Real:
        """Give the best values, ``[parameter]``."""
        low, high = np.array(self._bounds).T
        spans = high - low

        # Both walk in shares of the bounds: a pressure in Pa beside a stroke in m would tie a simplex's legs.
        def cost(shares: Real) -> float:
            return self._cost(low + shares * spans)

        unit = Bounds(np.zeros(spans.size), np.ones(spans.size))
        start = np.clip((self._initial - low) / spans, 0.0, 1.0)
        found = differential_evolution(
            cost, unit, x0=start, seed=seed, popsize=POPULATION, maxiter=GENERATIONS, tol=1e-4, polish=False
        )
        refined = minimize(
            cost,
            found.x,
            method="Nelder-Mead",
            bounds=unit,
            options={"xatol": 1e-6, "fatol": 1e-9, "maxiter": 100 * spans.size},
        )
        best = refined.x if refined.fun <= found.fun else found.x
        return np.asarray(low + best * spans)

    def told(self, values: Real) -> Optimum:
        """Say what the values do."""
        best = dict(zip(self._names, (float(value) for value in values), strict=True))
        tuned = self._model.with_values(best)
        before, after = self._path(self._initial), self._path(values)
        wished = tuple(measured(after, wish, size=self._size) for wish in self._wishes)
        missed = [
            f"{wish}: {'there is none' if one.value is None else f'{one.value:.4g} {one.unit}'} is the best found"
            for wish, one in zip(self._wishes, wished, strict=True)
            if one.value is None or wish.excess(one.value) > LIMIT_SLACK
        ]
        return Optimum(
            wishes=tuple(str(wish) for wish in self._wishes),
            initial=dict(zip(self._names, (float(value) for value in self._initial), strict=True)),
            values=best,
            wished_before=tuple(measured(before, wish, size=self._size) for wish in self._wishes),
            wished_after=wished,
            before=path_behaviour(before, size=self._size).quantities,
            after=path_behaviour(after, size=self._size).quantities,
            met=not missed,
            advice=(*(f"can't be met inside the bounds: {text}" for text in missed), *self._held(values)),
            model=tuned,
        )

    def _held(self, values: Real) -> list[str]:
        told = []
        for name, value, (low, high) in zip(self._names, values, self._bounds, strict=True):
            for end, side in ((low, "lower"), (high, "upper")):
                if abs(value - end) <= AT_BOUND * (high - low):
                    told.append(f"{name} lies at its {side} bound, {end:g}; a wider one may do better")
        return told

    def _cost(self, values: Real) -> float:
        try:
            path = self._path(values)
            found = [measured(path, wish, size=self._size).value for wish in self._wishes]
        except ModelError:
            return IMPOSSIBLE
        numbers = [value for value in found if value is not None]
        # Behaviour of what grows is no behaviour: such a candidate never wins.
        if len(numbers) < len(found) or not path.stable():
            return IMPOSSIBLE
        excess = sum(wish.excess(value) for wish, value in zip(self._wishes, numbers, strict=True))
        if excess > 0:
            return BROKEN * (1 + excess)
        if self._aim is None:
            return float(np.sum(((values - self._initial) / self._spans()) ** 2))
        # Over the value at the start, so that tolerances of the search mean the same for seconds and for hertz.
        value = numbers[self._wishes.index(self._aim)] / (self._scale or 1.0)
        return value if self._aim.sense == "least" else -value

    def _spans(self) -> Real:
        return np.array([high - low for low, high in self._bounds])

    def _measure(self, values: Real, wish: Wish) -> float | None:
        value = measured(self._path(values), wish, size=self._size).value
        return abs(value) if value else None

    def _path(self, values: Real) -> LinearPath:
        chosen = dict(zip(self._names, (float(value) for value in values), strict=True))
        source, output = self._ends
        return linear_path(self._model.with_values(chosen), from_input=source, to_outputs=(output,)).to(output)


def _checked_bounds(
    parameters: Parameters, names: Sequence[str], bounds: BoundsByName
) -> tuple[tuple[float, float], ...]:
    for name in bounds:
        if name not in names:
            raise ModelError(f"bounds of {name} are given, but it isn't free; free are: {', '.join(names)}")
    checked = []
    for name in names:
        parameter = parameters.require(name)
        low, high = bounds.get(name, (parameter.low, parameter.high))
        if not (parameter.minimum <= low < high <= parameter.maximum and np.isfinite(high - low)):
            raise ModelError(
                f"{name}: the bounds {low:g} to {high:g} must rise, "
                f"from {parameter.minimum:g} or more to {parameter.maximum:g} or less"
            )
        checked.append((float(low), float(high)))
    return tuple(checked)
