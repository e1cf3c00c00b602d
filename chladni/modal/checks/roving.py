"""Tests in which hammer or accelerometer wander: their parts joined to one set of functions."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from chladni.modal.checks.driving_point import same_place
from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance
from chladni.signals.wording import counted
from chladni.spectral.forms import MOTION_ORDER, form

# Lines of parts that were measured one after another are equal but for the rounding of their rate.
SAME_LINES = 1e-6
# What parts a reference from a response at the same place in files that name channels by their place.
REFERENCE = " (reference)"


def join_references(parts: Sequence[FrequencyResponse]) -> FrequencyResponse:
    """Join functions that were measured in parts to one set between all responses and all references.

    Parameters
    ----------
    parts
        With the same lines. Where the hammer wandered, each part has the same responses and another reference; where
        an accelerometer wandered, the same reference and another response; both may. Channels are the same when they
        have the same point and direction, or without these the same name.

    Returns
    -------
    FrequencyResponse
        ``[response, reference, frequency]`` in the order of first appearance. A line is excited when all parts excite
        it; the coherence of a response is the least that it has in any part; averages are those of the part with the
        fewest.

    Raises
    ------
    EstimateError
        When there is no part, lines, units, forms or windows differ, a function is there twice, or one is missing.

    Examples
    --------
    >>> def part(hammer):
    ...     return FrequencyResponse(
    ...         frequency_hz=np.arange(3.0), values=np.ones((1, 1, 3), complex), std=np.zeros((1, 1, 3)),
    ...         coherence=np.ones((1, 3)), excited=np.ones(3, bool),
    ...         responses=(Channel(name="a", unit="m/s^2", point="tip", direction=(0.0, 0.0, 1.0)),),
    ...         references=(Channel(name="f", unit="N", point=hammer, direction=(0.0, 0.0, 1.0)),),
    ...         provenance=Provenance(),
    ...     )
    >>> [channel.name for channel in join_references([part("root"), part("tip")]).references]
    ['f (root)', 'f (tip)']
    """
    _require_joinable(parts)
    responses = _distinct([channel for part in parts for channel in part.responses])
    references = _distinct([channel for part in parts for channel in part.references])
    lines = parts[0].frequency_hz.size
    values = np.zeros((len(responses), len(references), lines), dtype=np.complex128)
    std = np.zeros(values.shape)
    coherence = np.ones((len(responses), lines))
    owner = np.full(values.shape[:2], -1)
    for number, part in enumerate(parts):
        rows = [_place(channel, responses) for channel in part.responses]
        columns = [_place(channel, references) for channel in part.references]
        _require_new(owner, rows, columns, number, responses, references)
        owner[np.ix_(rows, columns)] = number
        values[np.ix_(rows, columns)] = part.values
        std[np.ix_(rows, columns)] = part.std
        coherence[rows] = np.minimum(coherence[rows], part.coherence)
    _require_complete(owner, responses, references)
    return FrequencyResponse(
        frequency_hz=parts[0].frequency_hz,
        values=values,
        std=std,
        coherence=coherence,
        excited=np.logical_and.reduce([part.excited for part in parts]),
        responses=_named_apart(responses),
        references=_named_apart(references),
        provenance=_joined_provenance(parts),
    )


def roving_hammer(parts: Sequence[FrequencyResponse]) -> FrequencyResponse:
    """Join the parts of a roving hammer test and turn it round, so that the points that were hit carry the shape.

    Parameters
    ----------
    parts
        With the same responses (the fixed accelerometers, of one unit) and one or several hit points each.

    Returns
    -------
    FrequencyResponse
        The transpose: responses are the hit points, as if an accelerometer had been there along the hammer's
        direction, references the fixed accelerometers, as if they had been hit. A note says so. The coherence of a
        hit point is the least over the accelerometers of its part.

    Raises
    ------
    EstimateError
        As `join_references`; also when accelerometers or hammers have several units or aren't motions and forces.

    Notes
    -----
    By Maxwell's and Betti's reciprocity H_ij = H_ji for motions and forces (or rotations and moments) that do work on
    each other; it holds for linear structures without gyroscopic or follower forces. `check_reciprocity` tests it
    where a pair was measured both ways.
    """
    joined = join_references(parts)
    coherence = np.array([_least_coherence(parts, channel) for channel in _hit(parts)])
    turned = _turned_round(joined, coherence)
    # Fails for what is no motion: only motion per force may be turned round.
    form(joined)
    return turned


def over_hit_points(response: FrequencyResponse) -> FrequencyResponse:
    """Turn functions of fewer responses than references round, so that shapes have a component for each reference.

    A hammer that roved past a fixed accelerometer leaves one response over many references; its shapes would have one
    component. Functions that have as many responses, or that reciprocity doesn't hold for (a reference that is a
    motion, several units), stay as they are.

    Examples
    --------
    >>> hit = [Channel(name=f"hammer{at}", unit="N", role="reference") for at in range(3)]
    >>> row = FrequencyResponse(
    ...     frequency_hz=np.arange(4.0), values=np.ones((1, 3, 4), complex), std=np.zeros((1, 3, 4)),
    ...     coherence=np.ones((1, 4)), excited=np.ones(4, bool), responses=(Channel(name="a", unit="m/s^2"),),
    ...     references=tuple(hit), provenance=Provenance(),
    ... )
    >>> [channel.name for channel in over_hit_points(row).responses]
    ['hammer0', 'hammer1', 'hammer2']
    """
    answers, sources = response.responses, response.references
    units = [{channel.unit for channel in channels} for channels in (answers, sources)]
    if len(answers) >= len(sources) or any(len(unit) > 1 for unit in units) or units[1] & MOTION_ORDER.keys():
        return response
    turned = _turned_round(response, np.repeat(response.coherence.min(axis=0)[np.newaxis], len(sources), axis=0))
    known = response.provenance.effective_averages
    # Each further reference spent one average on every function.
    averages = max(known - (len(sources) - len(answers)), 1.0) if known else 0.0
    return replace(turned, provenance=replace(turned.provenance, effective_averages=averages))


def _turned_round(response: FrequencyResponse, coherence: Real) -> FrequencyResponse:
    """The transpose: places that were hit as responses, places that were measured as references."""
    measured, applied = _only_unit(response.responses, "responses"), _only_unit(response.references, "references")
    note = (
        f"roving hammer: {counted(len(response.references), 'hit point')} taken as responses and "
        f"{counted(len(response.responses), 'accelerometer')} as reference, by reciprocity"
    )
    hit = [channel.name.removesuffix(REFERENCE) for channel in response.references]
    fixed = [channel.name + REFERENCE if channel.name in hit else channel.name for channel in response.responses]
    return FrequencyResponse(
        frequency_hz=response.frequency_hz,
        values=response.values.transpose(1, 0, 2),
        std=response.std.transpose(1, 0, 2),
        coherence=coherence,
        excited=response.excited,
        responses=tuple(
            replace(channel, name=name, unit=measured, role="response", overload=None)
            for channel, name in zip(response.references, hit, strict=True)
        ),
        references=tuple(
            replace(channel, name=name, unit=applied, role="reference", overload=None)
            for channel, name in zip(response.responses, fixed, strict=True)
        ),
        provenance=response.provenance.with_notes(note),
    )


def _same(one: Channel, other: Channel) -> bool:
    placed = [channel.point is not None and channel.direction is not None for channel in (one, other)]
    # The hammer has one name wherever it hits, and the wandering accelerometer too: the place tells them apart.
    return same_place(one, other) == 1 if all(placed) else one.name == other.name and not any(placed)


def _distinct(channels: Sequence[Channel]) -> list[Channel]:
    distinct: list[Channel] = []
    for channel in channels:
        if not any(_same(channel, known) for known in distinct):
            distinct.append(channel)
    return distinct


def _place(channel: Channel, channels: Sequence[Channel]) -> int:
    return next(place for place, known in enumerate(channels) if _same(channel, known))


def _named_apart(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Channels under names of their own: those that share one get their point, and their axis where it takes that."""
    names = [channel.name for channel in channels]
    suffixes: list[Callable[[Channel], str]] = [
        lambda channel: f" ({channel.point})",
        lambda channel: " ({}, {:g} {:g} {:g})".format(channel.point, *(channel.direction or (0.0, 0.0, 0.0))),
    ]
    for suffix in suffixes:
        shared = {name for name in names if names.count(name) > 1}
        if not shared:
            break
        names = [
            channel.name + suffix(channel) if name in shared else name
            for channel, name in zip(channels, names, strict=True)
        ]
    return tuple(channel.with_name(name) for channel, name in zip(channels, names, strict=True))


def _require_joinable(parts: Sequence[FrequencyResponse]) -> None:
    if not parts:
        raise EstimateError("no part to join; give at least one set of functions")
    first = parts[0]
    for number, part in enumerate(parts[1:], start=2):
        if part.frequency_hz.shape != first.frequency_hz.shape or not np.allclose(
            part.frequency_hz, first.frequency_hz, rtol=SAME_LINES, atol=0
        ):
            lines = [f"{p.frequency_hz.size} lines to {p.frequency_hz[-1]:g} Hz" for p in (first, part)]
            raise EstimateError(
                f"part 1 has {lines[0]}, part {number} {lines[1]}: make all with the same resolution and rate"
            )
        decays = [p.provenance.window_decay_per_s for p in (first, part)]
        if not np.isclose(decays[0], decays[1], rtol=SAME_LINES):
            raise EstimateError(
                f"part 1 has an exponential window of {decays[0]:g}/s, part {number} of {decays[1]:g}/s: their poles "
                "differ; give all the same window"
            )
    _require_units([channel for part in parts for channel in part.responses])
    _require_units([channel for part in parts for channel in part.references])


def _require_units(channels: Sequence[Channel]) -> None:
    for channel in channels:
        twin = next(known for known in channels if _same(channel, known))
        if twin.unit != channel.unit:
            raise EstimateError(
                f"{channel.name!r} is in {channel.unit} in one part and in {twin.unit} in another; convert_form "
                "or the setup file brings them to one unit"
            )


def _require_new(
    owner: Whole,
    rows: list[int],
    columns: list[int],
    number: int,
    responses: Sequence[Channel],
    references: Sequence[Channel],
) -> None:
    taken = np.argwhere(owner[np.ix_(rows, columns)] >= 0)
    if taken.size:
        row, column = rows[taken[0][0]], columns[taken[0][1]]
        raise EstimateError(
            f"{_where(responses[row])} / {_where(references[column])} is in part {owner[row, column] + 1} and in "
            f"part {number + 1}; leave one out, or average its records before"
        )


def _require_complete(owner: Whole, responses: Sequence[Channel], references: Sequence[Channel]) -> None:
    missing = np.argwhere(owner < 0)
    if missing.size:
        row, column = missing[0]
        raise EstimateError(
            f"{counted(len(missing), 'function')} of {owner.size} not measured, the first "
            f"{_where(responses[row])} / {_where(references[column])}; measure it, or leave its channel out"
        )


def _where(channel: Channel) -> str:
    return repr(channel.name) if channel.point is None else f"{channel.name!r} at {channel.point}"


def _joined_provenance(parts: Sequence[FrequencyResponse]) -> Provenance:
    fewest = min((part.provenance for part in parts), key=lambda provenance: provenance.effective_averages)
    notes = [note for part in parts for note in part.provenance.notes]
    return replace(fewest, notes=()).with_notes(f"joined from {counted(len(parts), 'measurement')}", *notes)


def _only_unit(channels: Sequence[Channel], what: str) -> str:
    units = sorted({channel.unit for channel in channels})
    if len(units) != 1:
        raise EstimateError(f"{what} in {' and '.join(units)} can't be turned round together; select one unit")
    return units[0]


def _hit(parts: Sequence[FrequencyResponse]) -> list[Channel]:
    return _distinct([channel for part in parts for channel in part.references])


def _least_coherence(parts: Sequence[FrequencyResponse], hit: Channel) -> Real:
    """Coherence of a hit point: the least that any accelerometer had when it was hit."""
    own = [part.coherence for part in parts if any(_same(hit, channel) for channel in part.references)]
    return np.asarray(np.concatenate(own).min(axis=0), dtype=np.float64)
