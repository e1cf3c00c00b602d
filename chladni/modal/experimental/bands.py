"""Fits band by band joined to one set of modes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Index, Real, Whole
from chladni.signals.errors import EstimateError
from chladni.signals.modal_fit import ModalFit
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.order_spread import OrderSpread
from chladni.signals.provenance import Provenance
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.value import ScalarT

# Modes of two bands are one when their frequencies agree within so many sigmas, or within this part of the half-power
# width (sigmas know nothing of what the other band's modes add at the border), and their shapes agree.
SAME_SIGMAS, SAME_WIDTHS, SAME_MAC = 3.0, 0.5, 0.8


def join_bands(sets: Sequence[ModeSet]) -> ModeSet:
    """Join the modes of several bands; a mode that two bands found is taken from the one that knows it better.

    Parameters
    ----------
    sets
        At least one, of the same channels and references; bands may overlap.

    Returns
    -------
    ModeSet
        With the uncertainty that each mode has in its band. Where bands overlap, the synthesis is that of the band
        whose middle is nearer; its error is put together from the bands' errors. Scale, spread, fit and diagram are
        there when all the sets have them.

    Raises
    ------
    EstimateError
        When there is no set, or their channels or references differ.
    """
    if not sets:
        raise EstimateError("no sets of modes to join")
    first = sets[0]
    for other in sets[1:]:
        _require_same(first, other)
    if len(sets) == 1:
        return first
    choice = _choose(sets)
    return ModeSet(
        frequency_hz=choice.of([one.frequency_hz for one in sets]),
        frequency_std_hz=choice.of([one.frequency_std_hz for one in sets]),
        damping_ratio=choice.of([one.damping_ratio for one in sets]),
        damping_std=choice.of([one.damping_std for one in sets]),
        shapes=choice.of([one.shapes for one in sets]),
        shape_std=choice.of([one.shape_std for one in sets]),
        channels=first.channels,
        references=first.references,
        participation=_participation(sets, choice),
        scale=_scale(sets, choice),
        spread=_spread(sets, choice),
        harmonics=tuple({line.frequency_hz: line for one in sets for line in one.harmonics}.values()),
        fit=_fit(sets, choice.of([one.frequency_hz for one in sets])),
        stabilisation=_diagram(sets, choice),
        provenance=_provenance(sets, choice),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Choice:
    """Which modes of all sets, one after the other, stay: ``rows``; ``place[row]`` is where each ends up."""

    rows: Whole
    place: Whole

    def of(self, parts: Sequence[NDArray[ScalarT]]) -> NDArray[ScalarT]:
        chosen: NDArray[ScalarT] = np.concatenate(list(parts))[self.rows]
        return chosen

    @property
    def merged(self) -> int:
        return int(self.place.size - self.rows.size)


def _require_same(first: ModeSet, other: ModeSet) -> None:
    for what, one, two in (
        ("channels", first.channels, other.channels),
        ("references", first.references, other.references),
    ):
        if one != two:
            names = [", ".join(channel.name for channel in side) or "none" for side in (one, two)]
            raise EstimateError(f"bands have different {what}: {names[0]} against {names[1]}; join those of one test")


def _choose(sets: Sequence[ModeSet]) -> _Choice:
    frequency_hz = np.concatenate([one.frequency_hz for one in sets])
    std_hz = np.concatenate([one.frequency_std_hz for one in sets])
    damping = np.concatenate([one.damping_ratio for one in sets])
    shapes = np.concatenate([one.shapes for one in sets])
    origin = np.repeat(np.arange(len(sets)), [one.frequency_hz.size for one in sets])
    kept: list[int] = []
    stands_for = np.arange(frequency_hz.size)
    # The best known first, so that each of the others meets the one that stands for it.
    for mode in np.argsort(std_hz, kind="stable").tolist():
        for better in kept:
            reach = max(
                SAME_SIGMAS * float(np.hypot(std_hz[mode], std_hz[better])),
                SAME_WIDTHS * float(damping[mode] * frequency_hz[mode] + damping[better] * frequency_hz[better]),
            )
            near = abs(frequency_hz[mode] - frequency_hz[better]) <= reach
            # Modes of one band were told apart there.
            if near and origin[mode] != origin[better] and _likeness(shapes[mode], shapes[better]) >= SAME_MAC:
                stands_for[mode] = better
                break
        else:
            kept.append(mode)
    rows = np.array(sorted(kept, key=lambda mode: frequency_hz[mode]), dtype=np.int64)
    position = np.zeros(frequency_hz.size, np.int64)
    position[rows] = np.arange(rows.size)
    return _Choice(rows=rows, place=position[stands_for])


def _likeness(one: NDArray[np.complexfloating], other: NDArray[np.complexfloating]) -> float:
    return float(abs(np.vdot(one, other)) ** 2 / (np.vdot(one, one).real * np.vdot(other, other).real))


def _participation(sets: Sequence[ModeSet], choice: _Choice) -> NDArray[np.complexfloating] | None:
    parts = [one.participation for one in sets if one.participation is not None]
    return choice.of(parts) if len(parts) == len(sets) else None


def _scale(sets: Sequence[ModeSet], choice: _Choice) -> ModalScale | None:
    # An empty set has nothing to scale, whatever its driving point.
    parts = [one.scale for one in sets if one.scale is not None]
    if not parts or len(parts) != sum(one.frequency_hz.size > 0 for one in sets):
        return None
    if len({(scale.response, scale.reference) for scale in parts}) > 1:
        return None
    return ModalScale(
        response=parts[0].response,
        reference=parts[0].reference,
        modal_a=choice.of([scale.modal_a for scale in parts]),
        modal_mass=choice.of([scale.modal_mass for scale in parts]),
        modal_mass_std=choice.of([scale.modal_mass_std for scale in parts]),
    )


def _spread(sets: Sequence[ModeSet], choice: _Choice) -> OrderSpread | None:
    parts = [one.spread for one in sets if one.spread is not None]
    if len(parts) != len(sets):
        return None
    return OrderSpread(
        orders=choice.of([spread.orders for spread in parts]),
        frequency_hz=choice.of([spread.frequency_hz for spread in parts]),
        frequency_std_hz=choice.of([spread.frequency_std_hz for spread in parts]),
        damping_ratio=choice.of([spread.damping_ratio for spread in parts]),
        damping_std=choice.of([spread.damping_std for spread in parts]),
    )


def _diagram(sets: Sequence[ModeSet], choice: _Choice) -> StabilisationDiagram | None:
    parts = [one.stabilisation for one in sets if one.stabilisation is not None]
    if len(parts) != len(sets):
        return None
    counts = [one.frequency_hz.size for one in sets]
    first_row = np.cumsum([0, *counts[:-1]])
    # The row behind the last one takes the poles of no mode.
    place = np.append(choice.place, -1)
    mode = [
        place[np.where(part.mode < 0, -1, part.mode + start)] for part, start in zip(parts, first_row, strict=True)
    ]
    order = np.concatenate([part.order for part in parts])
    rising = np.argsort(order, kind="stable")
    lines, first_seen = np.unique(np.concatenate([part.indicator_hz for part in parts]), return_index=True)
    return StabilisationDiagram(
        order=order[rising],
        frequency_hz=np.concatenate([part.frequency_hz for part in parts])[rising],
        damping_ratio=np.concatenate([part.damping_ratio for part in parts])[rising],
        status=np.concatenate([part.status for part in parts])[rising],
        mode=np.concatenate(mode)[rising],
        indicator_hz=lines,
        indicator=np.concatenate([part.indicator for part in parts], axis=1)[:, first_seen],
        indicator_name=parts[0].indicator_name,
        indicator_unit=parts[0].indicator_unit,
    )


def _fit(sets: Sequence[ModeSet], modes_hz: Real) -> ModalFit | None:
    parts = sorted((one.fit for one in sets if one.fit is not None), key=lambda fit: float(fit.frequency_hz.mean()))
    if len(parts) != sum(one.frequency_hz.size > 0 for one in sets) or not parts:
        return None
    lines = np.unique(np.concatenate([fit.frequency_hz for fit in parts]))
    middles = np.array([(fit.frequency_hz[0] + fit.frequency_hz[-1]) / 2 for fit in parts])
    reach = np.array([np.ptp(fit.frequency_hz) / 2 for fit in parts])
    # In units of half a band, so that a wide band doesn't lose its border to a narrow one inside it.
    off = np.abs(lines[:, None] - middles) / np.maximum(reach, 1e-300)
    owner = np.argmin(off, axis=1)
    synthesised = np.concatenate(
        [fit.synthesised[..., _rows(fit, lines[owner == number])] for number, fit in enumerate(parts)], axis=-1
    )
    order = np.argsort(np.concatenate([lines[owner == number] for number in range(len(parts))]), kind="stable")
    # A least-squares fit is orthogonal to what it leaves: measured power is that of the fit over 1 - error^2.
    power = [_power(fit) for fit in parts]
    wrong = [fit.function_error**2 * part for fit, part in zip(parts, power, strict=True)]
    return ModalFit(
        frequency_hz=lines,
        synthesised=synthesised[..., order],
        # What lies below all bands is what the lowest one has below it, and above as well.
        lower_residual=parts[0].lower_residual,
        upper_residual=parts[-1].upper_residual,
        error=float(np.sqrt(sum(part.sum() for part in wrong) / sum(part.sum() for part in power))),
        function_error=np.sqrt(sum(wrong) / np.maximum(sum(power), 1e-300)),
        bands_hz=np.concatenate([fit.bands_hz for fit in parts]),
        band_error=np.concatenate([fit.band_error for fit in parts]),
        poles_hz=np.sort(np.concatenate([modes_hz, *(_others_hz(one) for one in sets)])),
    )


def _others_hz(found: ModeSet) -> Real:
    """Poles of a band's synthesis that are none of its modes."""
    return np.zeros(0) if found.fit is None else np.setdiff1d(found.fit.poles_hz, found.frequency_hz)


def _power(fit: ModalFit) -> Real:
    share = 1 - np.minimum(fit.function_error, 0.9) ** 2
    return np.asarray(np.sum(np.abs(fit.synthesised) ** 2, axis=-1) / share, dtype=np.float64)


def _rows(fit: ModalFit, lines: Real) -> Index:
    return np.searchsorted(fit.frequency_hz, lines)


def _provenance(sets: Sequence[ModeSet], choice: _Choice) -> Provenance:
    notes = [note for one in sets for note in one.provenance.notes]
    if choice.merged:
        what = "mode was" if choice.merged == 1 else "modes were"
        notes.append(f"{choice.merged} {what} found by two bands, and taken from the one with the smaller sigma")
    estimators = dict.fromkeys(one.provenance.estimator for one in sets)
    account = replace(sets[0].provenance, notes=(), estimator=", ".join(estimators))
    return account.with_notes(*notes)
