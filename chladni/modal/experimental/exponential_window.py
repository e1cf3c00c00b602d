"""The damping that an exponential window adds, taken off again."""

from dataclasses import replace
from math import pi

import numpy as np

from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import find_channel
from chladni.signals.errors import EstimateError
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.order_spread import OrderSpread
from chladni.spectral.forms import MOTION_ORDER


def without_window_damping(modes: ModeSet, decay_per_s: float) -> ModeSet:
    """Take the damping of an exponential window exp(-sigma t) off the modes of windowed records.

    Parameters
    ----------
    modes
        Modes of frequency responses (or of free decays) that were windowed.
    decay_per_s
        Decay rate sigma of the window, 0 or positive; ``response.provenance.window_decay_per_s`` holds it.

    Returns
    -------
    ModeSet
        Every pole moved by +sigma: natural frequency, damping ratio, their std and their spread over orders, all
        exact. Participation and scale are turned by what the pole moved in the form that was measured. A mode that
        would have no damping left is kept out, and a note says which and why. The synthesis and the indicator stay
        those of the windowed functions, that were fitted.

    Raises
    ------
    EstimateError
        When the rate is negative or not finite, or is not the one that the modes carry.

    Notes
    -----
    The Laplace transform of x exp(-sigma t) is X(s + sigma). When the window multiplies response *and* force, as in
    `chladni.spectral.impact.impact_cross_spectra`, the measured function is exactly H(s + sigma), whose poles
    are lambda_r - sigma (Fladung & Rost 1997). When it multiplies the response only, the force must have ended long
    before 1/sigma after its onset t_0: the poles move in the same way, and participation is too small by the window's
    value there, exp(-sigma t_0), which isn't corrected here because the functions don't tell t_0.

    The measured form is H times (s + sigma)^n, n = 0, 1, 2 for receptance, mobility, accelerance, but is fitted with
    s^n: so participation comes out too large by (lambda_r/(lambda_r - sigma))^n and is divided by it.

    One sigma of frequency and damping is propagated as if their errors were independent, which they are to the first
    order in the damping ratio.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> from chladni.signals.provenance import Provenance
    >>> modes = ModeSet(
    ...     frequency_hz=np.array([10.0]), frequency_std_hz=np.array([0.01]), damping_ratio=np.array([0.03]),
    ...     damping_std=np.array([0.001]), shapes=np.ones((1, 1), complex), shape_std=np.zeros((1, 1), complex),
    ...     channels=(Channel(name="a", unit="m/s^2"),), provenance=Provenance(),
    ... )
    >>> corrected = without_window_damping(modes, 0.02 * 2 * pi * 10.0)
    >>> corrected.damping_ratio.round(4)
    array([0.01])
    """
    carried = modes.provenance.window_decay_per_s
    if not (np.isfinite(decay_per_s) and decay_per_s >= 0):
        raise EstimateError(f"decay_per_s is {decay_per_s}; the decay rate of a window is finite and 0 or positive")
    if carried and not np.isclose(carried, decay_per_s, rtol=1e-6):
        raise EstimateError(
            f"decay_per_s is {decay_per_s:g}, but the modes were measured through {carried:g}/s; give that rate"
        )
    if decay_per_s == 0:
        return modes
    frequency_hz, damping_ratio = _shifted(modes.frequency_hz, modes.damping_ratio, decay_per_s)
    frequency_std_hz, damping_std = _propagated(
        modes.frequency_hz, modes.damping_ratio, modes.frequency_std_hz, modes.damping_std, decay_per_s
    )
    turned = _turned(modes, decay_per_s)
    moved = replace(
        turned,
        frequency_std_hz=frequency_std_hz,
        damping_std=damping_std,
        spread=None if modes.spread is None else _shifted_spread(modes.spread, decay_per_s),
        provenance=replace(modes.provenance, window_decay_per_s=0.0).with_notes(
            *_notes(modes, damping_ratio, damping_std, decay_per_s)
        ),
    )
    return _kept(moved, frequency_hz, damping_ratio)


def _shifted(frequency_hz: Real, damping_ratio: Real, decay_per_s: float) -> tuple[Real, Real]:
    """Natural frequency and damping ratio of poles that moved by +sigma."""
    omega = 2 * pi * frequency_hz
    real = decay_per_s - damping_ratio * omega
    shifted = np.hypot(real, omega * np.sqrt(1 - damping_ratio**2))
    return np.asarray(shifted / (2 * pi)), np.asarray(-real / shifted)


def _propagated(
    frequency_hz: Real, damping_ratio: Real, frequency_std_hz: Real, damping_std: Real, decay_per_s: float
) -> tuple[Real, Real]:
    """One sigma after the shift, from the derivatives of `_shifted`."""
    omega, zeta = 2 * pi * frequency_hz, damping_ratio
    shifted_hz, shifted_zeta = _shifted(frequency_hz, damping_ratio, decay_per_s)
    shifted = 2 * pi * shifted_hz
    by_omega, by_zeta = (omega - decay_per_s * zeta) / shifted, -decay_per_s * omega / shifted
    omega_std = 2 * pi * frequency_std_hz
    frequency_std = np.hypot(by_omega * omega_std, by_zeta * damping_std) / (2 * pi)
    # The decay rate zeta omega loses sigma, whatever it is: its error stays, and the ratio's follows.
    ratio_by_omega = (zeta - shifted_zeta * by_omega) / shifted
    ratio_by_zeta = (omega - shifted_zeta * by_zeta) / shifted
    return frequency_std, np.hypot(ratio_by_omega * omega_std, ratio_by_zeta * damping_std)


def _turned(modes: ModeSet, decay_per_s: float) -> ModeSet:
    """Modes whose shapes and scale are freed of s^n in place of (s + sigma)^n."""
    ratio = modes.poles / (modes.poles + decay_per_s)
    orders = np.array([MOTION_ORDER.get(channel.unit, 0) for channel in modes.channels], dtype=np.int64)
    largest = orders[np.argmax(np.abs(modes.shapes), axis=1)]
    # What all channels share goes to the participation; shapes turn only where forms differ.
    relative = ratio[:, np.newaxis] ** (orders - largest[:, np.newaxis])
    common = ratio**largest
    participation = None if modes.participation is None else modes.participation * common[:, np.newaxis]
    scale = None if modes.scale is None else _turned_scale(modes, modes.scale, relative, common)
    return replace(modes, shapes=modes.shapes * relative, participation=participation, scale=scale)


def _turned_scale(modes: ModeSet, scale: ModalScale, relative: Complex, common: Complex) -> ModalScale:
    # a_r = psi_dr / L_dr: the driving point's own factor over that of the participation.
    row = find_channel(modes.channels, scale.response, role="driving point")
    modal_a = scale.modal_a * relative[:, row] / common
    return replace(scale, modal_a=modal_a, modal_mass=(modal_a / (2j * modes.poles.imag)).real)


def _shifted_spread(spread: OrderSpread, decay_per_s: float) -> OrderSpread:
    frequency_hz, damping_ratio = _shifted(spread.frequency_hz, spread.damping_ratio, decay_per_s)
    frequency_std_hz, damping_std = _propagated(
        spread.frequency_hz, spread.damping_ratio, spread.frequency_std_hz, spread.damping_std, decay_per_s
    )
    return replace(
        spread,
        frequency_hz=frequency_hz,
        damping_ratio=damping_ratio,
        frequency_std_hz=frequency_std_hz,
        damping_std=damping_std,
    )


def _kept(modes: ModeSet, frequency_hz: Real, damping_ratio: Real) -> ModeSet:
    """Give the modes whose pole is still on the stable side, by rising frequency, at their new place."""
    # Close modes of unequal damping may have changed places, which a set in the making must not show.
    rows = np.argsort(frequency_hz, kind="stable")
    rows = rows[damping_ratio[rows] > 0]
    return replace(
        modes,
        frequency_hz=frequency_hz[rows],
        frequency_std_hz=modes.frequency_std_hz[rows],
        damping_ratio=damping_ratio[rows],
        damping_std=modes.damping_std[rows],
        shapes=modes.shapes[rows],
        shape_std=modes.shape_std[rows],
        participation=None if modes.participation is None else modes.participation[rows],
        scale=None if modes.scale is None else modes.scale.select(rows),
        spread=None if modes.spread is None else modes.spread.select(rows),
        stabilisation=None if modes.stabilisation is None else modes.stabilisation.select(rows),
    )


def _notes(modes: ModeSet, damping_ratio: Real, damping_std: Real, decay_per_s: float) -> list[str]:
    """Say by how much, and which modes have no damping left."""
    notes = []
    removed = modes.damping_ratio - damping_ratio
    if removed.size:
        notes.append(
            f"the exponential window of {decay_per_s:g}/s is taken off: damping ratios are {removed.max():.3g} to "
            f"{removed.min():.3g} lower than measured; diagram and synthesis are those of the windowed functions"
        )
    notes += [
        f"the mode at {modes.frequency_hz[row]:.5g} Hz is left out: its damping ratio of "
        f"{modes.damping_ratio[row]:.3g} is less than the {removed[row]:.3g} that the window of {decay_per_s:g}/s "
        f"adds ({damping_ratio[row]:.2g} +- {damping_std[row]:.1g} would remain); take a slower window"
        for row in np.flatnonzero(damping_ratio <= 0)
    ]
    if modes.participation is not None and all(channel.unit not in MOTION_ORDER for channel in modes.channels):
        notes.append("the units of the responses are no motion, so participation isn't corrected for the window")
    return notes
