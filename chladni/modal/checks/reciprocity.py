"""Reciprocity: whether a structure answers at i to a force at j as it answers at j to a force at i."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from chladni.modal.checks.driving_point import same_place
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.value import Value, require_shape
from chladni.signals.wording import counted
from chladni.spectral.comparison import compare_responses

ReciprocityVerdict = Literal["reciprocal", "nearly reciprocal", "not reciprocal", "sign reversed", "not measured"]
BANDS = 8
# What calibration, and sensors beside the point that is hit, leave in a good test.
NEARLY = 0.1
# Where their number isn't known the std is taken at its word.
MANY_AVERAGES = 1e7


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReciprocityCheck(Value):
    """How far H_ij and H_ji are apart, pair by pair and band by band.

    Attributes
    ----------
    pairs
        Names (response i, reference j, response j, reference i) of each pair of functions.
    bands_hz
        ``[band, 2]`` low and high end.
    difference
        ``[pair, band]`` root of sum |H_ij - H_ji|^2 over mean of the sums of |H|^2; NaN in a band without lines.
    expected
        ``[pair, band]`` the same as far as the random error of both explains it.
    significant_share
        ``[pair]`` share of the lines whose difference the random error doesn't explain.
    verdict
        What follows from the numbers of all pairs.
    finding
        The same in a sentence, with what to do.
    """

    pairs: tuple[tuple[str, str, str, str], ...]
    bands_hz: Real
    difference: Real
    expected: Real
    significant_share: Real
    verdict: ReciprocityVerdict
    finding: str

    def __post_init__(self) -> None:
        expected = (len(self.pairs), len(self.bands_hz))
        require_shape("difference", self.difference, expected, "pairs x bands")
        require_shape("expected", self.expected, expected, "pairs x bands")
        require_shape("significant_share", self.significant_share, expected[:1], "pairs")
        self._freeze()


def check_reciprocity(
    response: FrequencyResponse, *, bands: int = BANDS, false_discovery: float = 0.01
) -> ReciprocityCheck:
    """Compare the functions that were measured both ways.

    Parameters
    ----------
    response
        Functions of one form with points and directions, two references at least.
    bands
        Number of equal bands that the excited lines are told in, at least 1.
    false_discovery
        Chance of calling any line of a reciprocal structure significant, 0 to 1.

    Returns
    -------
    ReciprocityCheck
        ``not measured`` when no pair was measured both ways: an answer, with what it would take.

    Raises
    ------
    EstimateError
        When the number of bands is below 1, the chance is out of range, or units of a pair differ.

    Notes
    -----
    Maxwell's and Betti's theorem: H_ij = H_ji for linear structures without gyroscopic or follower forces (Ewins
    2000, section 3.7). Lines are tested as in `chladni.spectral.comparison.compare_responses`.
    """
    if bands < 1:
        raise EstimateError(f"bands is {bands}; take at least one")
    found = _both_ways(response)
    if not found or not response.excited.any():
        return _not_measured()
    there, back = (_functions(response, [pair[way] for pair in found]) for way in (0, 1))
    compared = compare_responses(there, back, false_discovery=false_discovery)
    tested = np.isfinite(compared.change_db[:, 0])
    share = np.array(
        [
            np.mean(row[lines]) if lines.any() else 0.0
            for row, lines in zip(compared.significant[:, 0], tested, strict=True)
        ]
    )
    excited_hz = response.frequency_hz[response.excited]
    edges = np.linspace(excited_hz[0], excited_hz[-1], bands + 1)
    lines = [_band(response, tested, edges, band) for band in range(bands)]
    distances = [_distance(there, back, inside) for inside in lines]
    pairs = tuple(_names(response, pair) for pair in found)
    difference, expected = (np.stack([distance[k] for distance in distances], axis=1) for k in (0, 1))
    whole = _distance(there, back, tested)
    opposite = _distance(there, replace(back, values=-back.values), tested)[0] < 0.5 * whole[0]
    verdict = _verdict(whole[0], share, opposite)
    return ReciprocityCheck(
        pairs=pairs,
        bands_hz=np.stack([edges[:-1], edges[1:]], axis=1),
        difference=difference,
        expected=expected,
        significant_share=share,
        verdict=verdict,
        finding=_sentence(verdict, pairs, whole, share, opposite),
    )


Function = tuple[int, int, int]


def _both_ways(response: FrequencyResponse) -> list[tuple[Function, Function]]:
    """Pairs of functions (response, reference, sign) between the same two places, each pair once."""
    answers, sources = response.responses, response.references
    # Where each reference is among the responses, and with which sign.
    at = [
        [(row, sign) for row, answer in enumerate(answers) if (sign := same_place(answer, source))]
        for source in sources
    ]
    return [
        ((other_row, column, sign_other), (row, other, sign))
        for column in range(len(sources))
        for other in range(column + 1, len(sources))
        for row, sign in at[column]
        for other_row, sign_other in at[other]
        if answers[row].unit == answers[other_row].unit and row != other_row
    ]


def _functions(response: FrequencyResponse, chosen: list[Function]) -> FrequencyResponse:
    """The chosen functions, one a row, times their signs, under common names."""
    rows, columns, signs = (np.array(part) for part in zip(*chosen, strict=True))
    names = [f"pair {number}" for number in range(len(chosen))]
    # Each further reference spent one average on every function.
    known = response.provenance.effective_averages
    averages = max(known - (len(response.references) - 1), 1.0) if known else MANY_AVERAGES
    return replace(
        response,
        values=(response.values[rows, columns] * signs[:, np.newaxis])[:, np.newaxis],
        std=response.std[rows, columns][:, np.newaxis],
        coherence=response.coherence[rows],
        responses=tuple(response.responses[row].with_name(name) for row, name in zip(rows, names, strict=True)),
        references=response.references[:1],
        provenance=replace(response.provenance, effective_averages=averages),
    )


def _names(response: FrequencyResponse, pair: tuple[Function, Function]) -> tuple[str, str, str, str]:
    (row, column, _), (other_row, other_column, _) = pair
    return (
        response.responses[row].name,
        response.references[column].name,
        response.responses[other_row].name,
        response.references[other_column].name,
    )


def _band(response: FrequencyResponse, tested: Mask, edges: Real, band: int) -> Mask:
    inside = (response.frequency_hz >= edges[band]) & (response.frequency_hz < edges[band + 1])
    if band == len(edges) - 2:
        inside |= response.frequency_hz == edges[-1]
    return np.asarray(tested & inside)


def _distance(there: FrequencyResponse, back: FrequencyResponse, lines: Mask) -> tuple[Real, Real]:
    """Relative difference of each pair on its lines, and what random error makes of it."""

    def total(power: Real) -> Real:
        return np.asarray(np.where(lines, power[:, 0], 0.0).sum(axis=1), dtype=np.float64)

    level = (total(np.abs(there.values) ** 2) + total(np.abs(back.values) ** 2)) / 2
    level = np.where(level > 0, level, np.nan)
    # One sigma of the magnitude is one of the real and one of the imaginary part.
    random = 2 * (total(there.std**2) + total(back.std**2))
    apart = total(np.abs(there.values - back.values) ** 2)
    return np.sqrt(apart / level), np.sqrt(random / level)


def _verdict(difference: Real, share: Real, opposite: Mask) -> ReciprocityVerdict:
    if not np.any(share > 0):
        return "reciprocal"
    if opposite.any():
        return "sign reversed"
    return "nearly reciprocal" if np.nanmax(np.where(share > 0, difference, 0.0)) <= NEARLY else "not reciprocal"


def _sentence(
    verdict: ReciprocityVerdict,
    pairs: tuple[tuple[str, str, str, str], ...],
    whole: tuple[Real, Real],
    share: Real,
    opposite: Mask,
) -> str:
    measured = f"{counted(len(pairs), 'pair')} measured both ways"
    if verdict == "reciprocal":
        # A difference that isn't significant proves little where the error is large: so both are told.
        return (
            f"reciprocal: {measured}, no line of which differs by more than its random error (up to "
            f"{np.nanmax(whole[0]):.1%} in all, where {np.nanmax(whole[1]):.1%} is expected)"
        )
    worst = (
        int(np.argmax(opposite))
        if verdict == "sign reversed"
        else int(np.nanargmax(np.where(share > 0, whole[0], -1)))
    )
    response_i, reference_j, response_j, reference_i = pairs[worst]
    which = f"{response_i} / {reference_j} and {response_j} / {reference_i}"
    if verdict == "sign reversed":
        return f"{which} are reciprocal with opposite sign: turn one direction in the setup file"
    numbers = f"differ by {whole[0][worst]:.1%} where random error explains {whole[1][worst]:.1%}"
    remedy = (
        "calibration or position of sensors, usual in a good test"
        if verdict == "nearly reciprocal"
        else "check positions, directions and calibration, and whether the structure is linear"
    )
    return f"{verdict}: {measured}; {which} {numbers} ({share[worst]:.0%} of the lines): {remedy}"


def _not_measured() -> ReciprocityCheck:
    return ReciprocityCheck(
        pairs=(),
        bands_hz=np.zeros((0, 2)),
        difference=np.zeros((0, 0)),
        expected=np.zeros((0, 0)),
        significant_share=np.zeros(0),
        verdict="not measured",
        finding=(
            "reciprocity can't be checked: it takes excited lines and two references with points and directions, "
            "with a response at each"
        ),
    )
