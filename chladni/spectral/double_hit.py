"""A double hit: the hammer touches the structure twice within one record."""

from chladni.spectral.force_pulses import NOISE_SIGMAS, Pulses

# A softer blow lasts longer (Hertz: as its speed to the power of -1/5); what's much shorter than the first is the
# ringing of an anti-alias filter.
LIKE_THE_FIRST = 0.75


def second_pulse(pulses: Pulses, at: int, inside: slice, *, share: float) -> int | None:
    """Find the highest pulse of a record beside the main one, before or after it.

    Parameters
    ----------
    pulses
        Hits of the whole log.
    at
        Number of the main pulse, from 0.
    inside
        Samples of the record.
    share
        Rise from the nearest valley that counts, of the main pulse's peak, 0 to 1; never less than
        `NOISE_SIGMAS` of the force's noise.

    Returns
    -------
    int or None
        Sample of its peak in the log; None where the hammer hit once.
    """
    # Imported here, since scipy.signal costs most of a second and most logs hold no hammer.
    from scipy.signal import find_peaks

    force, peak, width = pulses.force, int(pulses.peaks[at]), pulses.widths[at]
    rise = max(share * float(force[peak]), NOISE_SIGMAS * pulses.noise)
    tops, _ = find_peaks(force[inside], prominence=rise, width=LIKE_THE_FIRST * width)
    # The main pulse is found too, and where its crest is flat not at its first sample.
    others = [top for top in (tops + inside.start).tolist() if abs(top - peak) > width / 2]
    return max(others, key=lambda top: float(force[top]), default=None)
