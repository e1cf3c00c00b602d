"""Measured functions beside those synthesised from modes: which are drawn, and together with which."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.modal_fit import ModalFit
from chladni.signals.mode_set import ModeSet
from chladni.signals.units import quotient
from chladni.viewers.groups import Group, groups
from chladni.viewers.labels import quantity, response_quantity

# More functions than this would fill a hundred figures; those that fit worst tell whether the rest can be trusted.
FUNCTIONS = 24
FUNCTIONS_IN_A_PLOT = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Overlay:
    """One function, measured and synthesised.

    Attributes
    ----------
    response, reference
        Its channels.
    frequency_hz, synthesised
        ``[line]`` what the modes give.
    measured_hz, measured
        ``[line]`` what was measured, in the band that was fitted; empty when the study has no measured function.
    error
        Share of the measured function that the modes leave.
    """

    response: Channel
    reference: Channel
    frequency_hz: Real
    synthesised: NDArray[np.complexfloating]
    measured_hz: Real
    measured: NDArray[np.complexfloating]
    error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class OverlayPage:
    """Functions of one kind to one reference that share a plot.

    Attributes
    ----------
    name
        Unique among the pages.
    part
        Which of several pages of its kind, such as `` 1/2``; empty when there is one.
    quantity, unit
        The field's word for such functions, and their unit.
    overlays
        The functions.
    """

    name: str
    part: str
    quantity: str
    unit: str
    overlays: tuple[Overlay, ...]


def overlay_pages(modes: ModeSet, measured: FrequencyResponse | None) -> list[OverlayPage]:
    """Divide the functions into pages, reference by reference; of very many, those with the greatest error."""
    fit = modes.fit
    if fit is None or fit.frequency_hz.size == 0:
        return []
    chosen = _worst(fit.function_error)
    return [
        _page(modes, fit, measured, column, part)
        for column in range(len(modes.references))
        for whole in groups(modes.channels, size=len(modes.channels))
        for part in _parts(whole, [row for row in whole.rows if chosen[row, column]])
    ]


def left_out(fit: ModalFit) -> str:
    """Say which functions aren't drawn; nothing when all are."""
    count = fit.function_error.size
    return f" · the {FUNCTIONS} of {count} functions with the greatest error" if count > FUNCTIONS else ""


def _worst(error: Real) -> Mask:
    # NaN, an error that isn't known, counts as the greatest.
    order = np.argsort(-np.nan_to_num(error.ravel(), nan=np.inf), kind="stable")[:FUNCTIONS]
    chosen = np.zeros(error.size, dtype=np.bool_)
    chosen[order] = True
    return chosen.reshape(error.shape)


def _parts(whole: Group, rows: list[int]) -> list[Group]:
    """Divide the rows that are drawn of a group of one unit into groups of few."""
    pages = -(-len(rows) // FUNCTIONS_IN_A_PLOT)
    # Pages of equal length read better than full ones and a rest of one.
    length = -(-len(rows) // max(pages, 1))
    parts = [tuple(rows[length * page : length * (page + 1)]) for page in range(pages)]
    return [
        Group(name=f"{whole.name} {page}/{pages}" if pages > 1 else whole.name, unit=whole.unit, rows=part)
        for page, part in enumerate(parts, start=1)
    ]


def _page(
    modes: ModeSet, fit: ModalFit, measured: FrequencyResponse | None, column: int, group: Group
) -> OverlayPage:
    unit = modes.references[column].unit
    return OverlayPage(
        name=f"{column + 1} {group.name}",
        part=group.name.removeprefix(quantity(group.unit)),
        quantity=response_quantity(group.unit, unit),
        unit=quotient(group.unit, unit),
        overlays=tuple(_overlay(modes, fit, measured, row, column) for row in group.rows),
    )


def _overlay(modes: ModeSet, fit: ModalFit, measured: FrequencyResponse | None, row: int, column: int) -> Overlay:
    response, reference = modes.channels[row], modes.references[column]
    hertz, values = _measured(measured, response.name, reference.name, fit.frequency_hz)
    return Overlay(
        response=response,
        reference=reference,
        frequency_hz=fit.frequency_hz,
        synthesised=fit.synthesised[row, column],
        measured_hz=hertz,
        measured=values,
        error=float(fit.function_error[row, column]),
    )


def _measured(
    measured: FrequencyResponse | None, response: str, reference: str, fitted_hz: Real
) -> tuple[Real, NDArray[np.complexfloating]]:
    """Give the measured function on its excited lines in the fitted band; nothing where it wasn't measured."""
    if measured is None:
        return np.empty(0), np.empty(0, dtype=np.complex128)
    rows = [row for row, channel in enumerate(measured.responses) if channel.name == response]
    columns = [column for column, channel in enumerate(measured.references) if channel.name == reference]
    hertz = measured.frequency_hz
    inside = measured.excited & (hertz >= fitted_hz[0]) & (hertz <= fitted_hz[-1])
    if not rows or not columns:
        inside = np.zeros_like(inside)
    return hertz[inside], np.asarray(measured.values[(*rows, 0)[0], (*columns, 0)[0], inside])
