"""Puts equations together from named sums, and turns them into the arrays of the integrator."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chladni.gap.blind.law_words import LAW_NUMBERS, LAW_STATES

#: A weighted sum of states, driving signals and laws, by name.
Sum = Mapping[str, float]
Matrix = NDArray[np.float64]
_MOST_NUMBERS = 8


def added(*terms: tuple[float, Sum]) -> dict[str, float]:
    """Weighted sum of sums.

    Examples
    --------
    >>> added((1.0, {"a": 2.0}), (-2.0, {"a": 1.0, "b": 1.0}))
    {'a': 0.0, 'b': -2.0}
    """
    total: dict[str, float] = {}
    for weight, part in terms:
        for name, share in part.items():
            total[name] = total.get(name, 0.0) + weight * share
    return total


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedLaw:
    """A law of `law_words.LAWS` and what it sees.

    Attributes
    ----------
    name
        Of what it gives.
    word
        Which law.
    d, s
        Sums of states, driving signals and laws that were placed before.
    numbers
        See the law.
    """

    name: str
    word: str
    d: Sum
    s: Sum
    numbers: tuple[float, ...]


@dataclass(slots=True)
class Assembly:
    """Equations under construction: driving signals, rates of states, laws and outputs."""

    inputs: list[str] = field(default_factory=list)
    rates: dict[str, dict[str, float]] = field(default_factory=dict)
    laws: list[PlacedLaw] = field(default_factory=list)
    outputs: dict[str, dict[str, float]] = field(default_factory=dict)
    #: Seconds by which an output is recorded late.
    shifts: dict[str, float] = field(default_factory=dict)

    def law(self, name: str, word: str, d: Sum, s: Sum, *numbers: float) -> dict[str, float]:
        """Place a law and give the sum that stands for its value."""
        self.laws.append(PlacedLaw(name=name, word=word, d=d, s=s, numbers=numbers))
        return {name: 1.0}

    def filtered(self, name: str, signal: Sum, num: Sequence[float], den: Sequence[float]) -> dict[str, float]:
        """Pass a signal through a ratio of polynomials in s, highest power first; `den` begins with 1."""
        # Observer form, as of second order: z1' = n1 u - d1 y + z2, z2' = n0 u - d0 y, with y = z1 + n2 u.
        out = added((1.0, {f"{name}.z1": 1.0}), (num[0], signal))
        for place in range(1, len(den)):
            following = [(1.0, {f"{name}.z{place + 1}": 1.0})] if place + 1 < len(den) else []
            self.rates[f"{name}.z{place}"] = added((num[place], signal), (-den[place], out), *following)
        return out

    def arrays(self, interval: float, steps: int) -> "Arrays":
        """Give what the integrator takes; a shift is rounded to its steps."""
        columns = [*self.inputs, *(law.name for law in self.laws)]
        of_state = {name: place for place, name in enumerate(self.rates)}
        of_signal = {name: place for place, name in enumerate(columns)}

        def rows(sums: list[Sum]) -> tuple[Matrix, Matrix]:
            x, e = np.zeros((len(sums), len(of_state))), np.zeros((len(sums), len(of_signal)))
            for row, one in enumerate(sums):
                for name, share in one.items():
                    if name in of_state:
                        x[row, of_state[name]] = share
                    else:
                        e[row, of_signal[name]] = share
            return x, e

        own = np.cumsum([0, *(LAW_STATES.get(law.word, 0) for law in self.laws)])
        numbers = np.zeros((len(self.laws), _MOST_NUMBERS))
        for row, law in enumerate(self.laws):
            numbers[row, : len(law.numbers)] = law.numbers
        words = np.array([LAW_NUMBERS[law.word] for law in self.laws], dtype=np.int64)
        return Arrays(
            system=(*rows(list(self.rates.values())), len(self.inputs)),
            law=(words, own[:-1].astype(np.int64), numbers,
                 *rows([law.d for law in self.laws]), *rows([law.s for law in self.laws])),
            observed=(*rows(list(self.outputs.values())),
                      np.array([round(self.shifts.get(name, 0.0) / interval * steps) for name in self.outputs],
                               dtype=np.int64)),
            states=len(self.rates) + int(own[-1]),
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrays:
    """What `chladni.gap.blind.kernel.march` takes."""

    system: tuple[Matrix, Matrix, int]
    law: tuple[NDArray[np.int64], NDArray[np.int64], Matrix, Matrix, Matrix, Matrix, Matrix]
    observed: tuple[Matrix, Matrix, NDArray[np.int64]]
    states: int


def fastest(assembly: Assembly, interval: float) -> float:
    """Largest magnitude of an eigenvalue of the linear part, 1/s."""
    a = assembly.arrays(interval, 1).system[0]
    return float(np.abs(np.linalg.eigvals(a)).max(initial=0.0))
