"""Accelerance, mobility and receptance: one frequency response in three forms."""

from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.unit_text import in_unit
from chladni.signals.units import differentiated, integrated

Form = Literal["accelerance", "mobility", "receptance"]

# How often the displacement has been differentiated to give the motion that the form speaks of.
ORDER: dict[Form, int] = {"receptance": 0, "mobility": 1, "accelerance": 2}
MOTION_ORDER = {"m": 0, "m/s": 1, "m/s^2": 2, "rad": 0, "rad/s": 1, "rad/s^2": 2}


def form(response: FrequencyResponse) -> Form:
    """Tell the form of a response from the units of its response channels.

    Raises
    ------
    EstimateError
        When a response is no motion, or the responses are of several forms.

    Notes
    -----
    Acceleration per force is accelerance, velocity per force mobility, displacement per force receptance
    (ISO 7626-1:2011); rotations follow their time derivative in the same way.
    """
    # The reference doesn't matter: a force, a voltage to a shaker and a base motion leave the same factor.
    orders = {_motion_order(channel) for channel in response.responses}
    if len(orders) != 1:
        units = ", ".join(sorted({channel.unit for channel in response.responses}))
        raise EstimateError(f"responses in {units} are of several forms; convert_form brings them to one")
    return next(name for name, order in ORDER.items() if order in orders)


def convert_form(response: FrequencyResponse, form: Form) -> FrequencyResponse:
    """Convert a frequency response to accelerance, mobility or receptance, with its unit.

    Parameters
    ----------
    response
        Responses in m, m/s, m/s^2 (or rad, ...); they may differ, each is converted from its own form.
    form
        ``accelerance``, ``mobility`` or ``receptance``.

    Returns
    -------
    FrequencyResponse
        Values and std multiplied by (j omega)^n and omega^n. Where n is negative the line at 0 Hz has no value:
        NaN, infinite std, not excited, and a note says so. The coherence is that of the measured motion.

    Raises
    ------
    EstimateError
        When a response is no motion, or the form is unknown.

    Notes
    -----
    v = j omega x, a = j omega v for x(t) = X e^{+j omega t} (ISO 7626-1:2011).
    """
    if form not in get_args(Form):
        raise EstimateError(f"form {form!r} is none of {', '.join(get_args(Form))}")
    steps = [ORDER[form] - _motion_order(channel) for channel in response.responses]
    if not any(steps):
        return response
    factors = np.stack([_power_of_j_omega(response.frequency_hz, step) for step in steps])[:, np.newaxis, :]
    # A mean displacement leaves no trace in an acceleration: no number would be right at 0 Hz.
    undefined = np.isnan(factors)
    converted = replace(
        response,
        values=response.values * factors,
        std=np.where(undefined, np.inf, response.std * np.abs(factors)),
        excited=response.excited & ~undefined.any(axis=(0, 1)),
        responses=tuple(_differentiated(c, step) for c, step in zip(response.responses, steps, strict=True)),
    )
    if not undefined.any():
        return converted
    note = f"{form} at 0 Hz is not defined by this measurement: its line is masked"
    return replace(converted, provenance=converted.provenance.with_notes(note))


def _motion_order(channel: Channel) -> int:
    if channel.unit not in MOTION_ORDER:
        raise EstimateError(
            f"{channel.name!r} {in_unit(channel.unit)} is no motion; accelerance, mobility and receptance exist for "
            f"{', '.join(MOTION_ORDER)} only: select such responses, or state the unit in the setup file"
        )
    return MOTION_ORDER[channel.unit]


def _power_of_j_omega(frequency_hz: Real, power: int) -> NDArray[np.complexfloating]:
    """(j 2 pi f)^power, NaN where that would divide by zero."""
    j_omega = 2j * np.pi * frequency_hz
    if power >= 0:
        return j_omega**power
    safe = np.where(frequency_hz == 0, 1.0, j_omega)
    return np.where(frequency_hz == 0, np.nan, safe**power)


def _differentiated(channel: Channel, times: int) -> Channel:
    unit = channel.unit
    for _ in range(abs(times)):
        unit = differentiated(unit) if times > 0 else integrated(unit)
    # An overload limit belongs to the quantity that was measured and means nothing for another one.
    return channel if times == 0 else replace(channel, unit=unit, overload=None)
