"""Modal mass and modal A from a driving point."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.modal.checks.driving_point import driving_points, same_direction
from chladni.modal.fit.fitted_modes import FittedModes
from chladni.signals.arrays import Complex
from chladni.signals.channel import Channel, find_channel
from chladni.signals.modal_scale import ModalScale
from chladni.spectral.forms import MOTION_ORDER

# Rows of a response and a reference, and -1 where they point oppositely.
Pair = tuple[int, int, int]
# Motions that a force, or a torque, does work on.
_MOTIONS = {"N": ("m", "m/s", "m/s^2"), "N m": ("rad", "rad/s", "rad/s^2")}
# A modal mass whose own sigma is more than this share of it is worth a word.
UNCERTAIN = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Scaling:
    """Scale of the modes, or why there is none.

    Attributes
    ----------
    scale
        None: unscaled.
    notes
        Why there is no scale, or what to distrust in it.
    """

    scale: ModalScale | None
    notes: tuple[str, ...] = ()


def modal_scale(
    fitted: FittedModes,
    responses: Sequence[Channel],
    references: Sequence[Channel],
    *,
    driving_point: tuple[str, str] | None = None,
) -> Scaling:
    """Scale modes by a driving point, where response and reference are the same point along the same axis.

    Parameters
    ----------
    fitted
        Modes with their participation.
    responses, references
        Channels of the frequency responses, in their order.
    driving_point
        Names of response and reference; default the pair that shares point and axis. Of several such pairs the one
        whose modal masses are surest is taken.

    Returns
    -------
    Scaling
        With a `ModalScale`, or with the reason why there is none.

    Raises
    ------
    EstimateError
        When `driving_point` names a channel that isn't there.

    Notes
    -----
    a_r = psi_d/L_d and m_r = Re(a_r/(2 j omega_d)) for shapes of largest component 1 (Maia & Silva 1997, section
    2.4); for a lightly damped real mode m_r is the modal mass phi^T M phi.
    """
    pairs = _pairs(responses, references, driving_point)
    if not pairs:
        return Scaling(scale=None, notes=(_no_pair(responses, references),))
    forces = [pair for pair in pairs if _does_work(responses[pair[0]], references[pair[1]])]
    if not forces:
        return Scaling(scale=None, notes=(_no_force(responses, references, pairs[0]),))
    pair = min(forces, key=lambda pair: _worst(fitted, pair))
    scale = _scale(fitted, responses, references, pair)
    return Scaling(scale=scale, notes=_doubts(fitted, scale))


def unit_modal_mass_shapes(shapes: NDArray[np.complexfloating], scale: ModalScale) -> Complex:
    """Scale shapes ``[mode, response]`` to unit modal mass, 1/sqrt(kg) for translations.

    A mode whose modal mass isn't positive has none, and its row is NaN.
    """
    unit = np.full(shapes.shape, np.nan, dtype=np.complex128)
    positive = scale.modal_mass > 0
    unit[positive] = shapes[positive] / np.sqrt(scale.modal_mass[positive])[:, np.newaxis]
    return unit


def _pairs(
    responses: Sequence[Channel], references: Sequence[Channel], named: tuple[str, str] | None
) -> tuple[Pair, ...]:
    """The pairs at one point along one direction, or the named pair wherever it is."""
    if named is None:
        return driving_points(responses, references)
    row = find_channel(responses, named[0], role="response")
    column = find_channel(references, named[1], role="reference")
    return ((row, column, same_direction(responses[row], references[column]) or 1),)


def _does_work(response: Channel, reference: Channel) -> bool:
    return response.unit in _MOTIONS.get(reference.unit, ())


def _scale(
    fitted: FittedModes, responses: Sequence[Channel], references: Sequence[Channel], pair: Pair
) -> ModalScale:
    model, (row, column, sign) = fitted.model, pair
    with np.errstate(divide="ignore", invalid="ignore"):
        modal_a = sign * model.shapes[:, row] / model.participation[:, column]
    return ModalScale(
        response=responses[row].name,
        reference=references[column].name,
        modal_a=modal_a,
        modal_mass=np.asarray((modal_a / (2j * model.poles.imag)).real, dtype=np.float64),
        modal_mass_std=fitted.modal_mass_std[:, row, column],
    )


def _worst(fitted: FittedModes, pair: Pair) -> float:
    model, (row, column, _) = fitted.model, pair
    with np.errstate(divide="ignore", invalid="ignore"):
        mass = np.abs(model.shapes[:, row] / model.participation[:, column] / (2 * model.poles.imag))
        doubt = fitted.modal_mass_std[:, row, column] / mass
    return float(np.max(np.nan_to_num(doubt, nan=np.inf), initial=0.0))


def _doubts(fitted: FittedModes, scale: ModalScale) -> tuple[str, ...]:
    frequency_hz = fitted.model.frequency_hz
    unsure = ~(scale.modal_mass_std < UNCERTAIN * np.abs(scale.modal_mass))
    negative = scale.modal_mass + 2 * scale.modal_mass_std < 0
    uncertain = [
        f"modal mass of the mode at {frequency_hz[mode]:.6g} Hz is very uncertain: the driving point "
        f"{scale.response} hardly moves in it; choose one away from its node"
        for mode in np.flatnonzero(unsure)
    ]
    reversed_ = [
        f"modal mass of the mode at {frequency_hz[mode]:.6g} Hz is negative: check directions and signs of "
        f"{scale.response} and {scale.reference}"
        for mode in np.flatnonzero(negative)
    ]
    return (*uncertain, *reversed_)


def _no_pair(responses: Sequence[Channel], references: Sequence[Channel]) -> str:
    if any(channel.point is None or channel.direction is None for channel in references):
        return (
            "unscaled: the setup doesn't say at which point and in which direction the references act; place them to "
            "get modal masses"
        )
    places = ", ".join(f"{channel.name} at {channel.point}" for channel in references)
    return (
        f"unscaled: none of the {len(responses)} responses is at the point and along the axis of a reference "
        f"({places}); measure a driving point to get modal masses"
    )


def _no_force(responses: Sequence[Channel], references: Sequence[Channel], pair: Pair) -> str:
    response, reference = responses[pair[0]], references[pair[1]]
    if reference.unit in _MOTIONS:
        return (
            f"unscaled: {response.name} in {response.unit} is no motion that {reference.name} in {reference.unit} "
            "does work on"
        )
    kind = "a motion" if reference.unit in MOTION_ORDER else "no force"
    return f"unscaled: the reference {reference.name} in {reference.unit} is {kind}; modal mass needs a force in N"
