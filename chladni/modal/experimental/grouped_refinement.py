"""Maximum likelihood for many modes: group after group, each in its own part of the band."""

from collections.abc import Sequence
from dataclasses import replace
from math import pi

import numpy as np

from chladni.modal.fit.fitted_modes import FittedModes
from chladni.modal.fit.lsfd import least_squares_frequency_domain
from chladni.modal.fit.maximum_likelihood import refine
from chladni.modal.fit.modal_model import ModalModel
from chladni.modal.fit.synthesis import modal_fit
from chladni.signals.arrays import Complex, Index, Mask
from chladni.signals.frequency_response import FrequencyResponse

# The work grows with the square of the modes fitted together, and with the lines.
ALONE, GROUP = 12, 8
# Each group is fitted twice, the second time with what the others have become.
SWEEPS = 2
# Half-power half-widths beyond the outer modes of a group that its fit takes in.
MARGIN = 10.0
FEWEST_LINES = 32


def grouped_refinement(
    response: FrequencyResponse, poles: Complex, participation: Complex, *, max_iterations: int
) -> FittedModes:
    """Refine poles by maximum likelihood; see `refine`.

    Parameters
    ----------
    response
        Only excited lines count.
    poles, participation
        ``[mode]`` in rad/s and ``[mode, reference]``.
    max_iterations
        Of each group.

    Returns
    -------
    FittedModes
        Up to a dozen modes are fitted together. More are cut into groups of neighbours at the widest gaps; each is
        fitted to the lines around it, after the modes far from it are taken off, with those of other groups that lie
        there and with residuals of its own.
    """
    whole = least_squares_frequency_domain(response, poles, participation)
    if poles.size <= ALONE:
        return refine(response, whole, max_iterations=max_iterations)
    started = np.arange(poles.size)
    for _ in range(SWEEPS):
        fitted = _joined([_refined(response, whole, group, max_iterations) for group in _groups(whole.poles)])
        if not fitted.kept.size:
            return fitted
        whole = least_squares_frequency_domain(response, fitted.model.poles, fitted.model.participation)
        started = started[fitted.kept]
    return replace(fitted, kept=started)


def _refined(response: FrequencyResponse, whole: ModalModel, group: Index, max_iterations: int) -> FittedModes:
    """Refine a group on what the modes far from it, as they are so far, leave of the functions around it."""
    band, members = _surroundings(response, whole.poles, group)
    far = np.setdiff1d(np.arange(whole.poles.size), members)
    inside = response.excited & (response.frequency_hz >= band[0]) & (response.frequency_hz <= band[1])
    values = np.array(response.values, dtype=np.complex128)
    # Residuals of the whole band are smooth here, and the group's own take them up.
    values[..., inside] -= modal_fit(response, _without_residuals(whole.select(far)), band_hz=band).synthesised
    rest = replace(response, values=values)
    fitted = refine(rest, whole.select(members), band_hz=band, max_iterations=max_iterations)
    fitted = replace(fitted, kept=members[fitted.kept])
    return select_modes(fitted, np.isin(fitted.kept, group))


def _without_residuals(model: ModalModel) -> ModalModel:
    return replace(model, lower=np.zeros_like(model.lower), upper=np.zeros_like(model.upper))


def _surroundings(response: FrequencyResponse, poles: Complex, group: Index) -> tuple[tuple[float, float], Index]:
    """Band in which a group is fitted, and its modes followed by those of other groups that lie there."""
    band = _band(response, poles, group)
    inside = np.flatnonzero((poles.imag >= 2 * pi * band[0]) & (poles.imag <= 2 * pi * band[1]))
    return band, np.concatenate([group, np.setdiff1d(inside, group)])


def _groups(poles: Complex) -> list[Index]:
    """Cut poles at the gap that is widest for its half-widths, until no group is too large."""
    waiting, found = [np.argsort(poles.imag, kind="stable")], []
    while waiting:
        rows = waiting.pop()
        if rows.size <= GROUP:
            found.append(rows)
            continue
        group = poles[rows]
        gaps = np.diff(group.imag) / -(group.real[1:] + group.real[:-1])
        # A cut near an end would leave a group that is hardly smaller.
        quarter = rows.size // 4
        cut = quarter + int(np.argmax(gaps[quarter : gaps.size - quarter])) + 1
        waiting += [rows[:cut], rows[cut:]]
    return found


def _band(response: FrequencyResponse, poles: Complex, group: Index) -> tuple[float, float]:
    """From midway to the next mode below to midway to the next above, but far enough to see the decay of its own."""
    excited_hz = response.frequency_hz[response.excited]
    own = poles[group] / (2 * pi)
    # As far as the group is wide: a single broad mode must not draw in half of the band.
    margin = np.minimum(-MARGIN * own.real, max(np.ptp(own.imag), -4 * own.real.mean()))
    low, high = float(np.min(own.imag - margin)), float(np.max(own.imag + margin))
    others = np.delete(poles.imag, group) / (2 * pi)
    below, above = others[others < own.imag.min()], others[others > own.imag.max()]
    low = min(low, (below.max() + own.imag.min()) / 2 if below.size else excited_hz[0])
    high = max(high, (above.min() + own.imag.max()) / 2 if above.size else excited_hz[-1])
    first = int(np.searchsorted(excited_hz, low))
    last = int(np.searchsorted(excited_hz, high, side="right")) - 1
    missing = max(FEWEST_LINES - (last - first + 1), 0)
    first, last = max(first - missing, 0), min(last + missing, excited_hz.size - 1)
    return float(excited_hz[first]), float(excited_hz[last])


def select_modes(fitted: FittedModes, chosen: Mask) -> FittedModes:
    """Give some of the modes of a fit, as they were fitted together with the others."""
    rows = np.flatnonzero(chosen)
    return replace(
        fitted,
        model=fitted.model.select(rows),
        kept=fitted.kept[rows],
        frequency_std_hz=fitted.frequency_std_hz[rows],
        damping_std=fitted.damping_std[rows],
        covariance=fitted.covariance[rows][:, :, rows],
        shape_std=fitted.shape_std[rows],
        participation_std=fitted.participation_std[rows],
        modal_mass_std=fitted.modal_mass_std[rows],
        inflation=fitted.inflation[rows],
    )


def _joined(parts: Sequence[FittedModes]) -> FittedModes:
    """All groups by rising frequency; covariance between groups is not known and taken as none."""
    model = _joined_model([part.model for part in parts])
    order = np.argsort(np.abs(model.poles), kind="stable")
    covariance = np.zeros((order.size, 2, order.size, 2))
    start = 0
    for part in parts:
        stop = start + part.kept.size
        covariance[start:stop, :, start:stop] = part.covariance
        start = stop
    weights = np.array([max(part.kept.size, 1) for part in parts], dtype=float)
    return FittedModes(
        model=model.select(order),
        kept=np.concatenate([part.kept for part in parts])[order],
        frequency_std_hz=np.concatenate([part.frequency_std_hz for part in parts])[order],
        damping_std=np.concatenate([part.damping_std for part in parts])[order],
        covariance=covariance[order][:, :, order],
        shape_std=np.concatenate([part.shape_std for part in parts])[order],
        participation_std=np.concatenate([part.participation_std for part in parts])[order],
        modal_mass_std=np.concatenate([part.modal_mass_std for part in parts])[order],
        chi_square=float(np.average([part.chi_square for part in parts], weights=weights)),
        inflation=np.concatenate([part.inflation for part in parts])[order],
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )


def _joined_model(models: Sequence[ModalModel]) -> ModalModel:
    # Residuals of a group stand for the modes of the others: none of them is one of the whole.
    return replace(
        models[0],
        poles=np.concatenate([model.poles for model in models]),
        shapes=np.concatenate([model.shapes for model in models]),
        participation=np.concatenate([model.participation for model in models]),
        lower=np.zeros_like(models[0].lower),
        upper=np.zeros_like(models[0].upper),
    )
