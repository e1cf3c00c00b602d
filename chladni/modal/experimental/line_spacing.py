"""How close spectral lines can lie for modes, and what to ask for where a resonance is narrower than they tell."""

from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.wording import rounded_up
from chladni.spectral.response_advice import closer_lines, longest_segment_s

# Segments of a record, end to end, that modes are identified from: half as many as a spectrum for the eye has, twice
# the lines in each peak. Each further reference takes some of the averages for itself.
SEGMENTS, SEGMENTS_A_REFERENCE = 8, 4
LONGEST_SEGMENT = 1 << 16
# Half-power widths in lines below which the damping rests on the window as much as on the structure.
COARSE = 2.0


def longest_modal_segment_s(response: FrequencyResponse) -> float:
    """Longest segment that leaves enough averages for modes, 0 where the functions aren't averages of segments."""
    account = response.provenance
    if account.averaging != "linear":
        return 0.0
    segments = SEGMENTS + SEGMENTS_A_REFERENCE * (len(response.references) - 1)
    rate_hz = 2 * float(response.frequency_hz[-1])
    return min(longest_segment_s(account, segments=segments), LONGEST_SEGMENT / rate_hz)


def lines_for(response: FrequencyResponse, width_hz: float) -> str:
    """Say how to get lines on which a half-power width of so many hertz can be judged."""
    longest_s = longest_modal_segment_s(response) or None
    return closer_lines(
        response.provenance, step_hz=_step_hz(response), wanted_hz=width_hz / COARSE, longest_s=longest_s
    )


def nothing_found(response: FrequencyResponse) -> str:
    """Say that there is no mode, and what to try where one may hide."""
    step_hz, longest_s = _step_hz(response), longest_modal_segment_s(response)
    told = "no mode: no pole is both found at enough model orders and needed to explain the functions"
    if not response.provenance.averages:
        return (
            f"{told}; look at another band, or measure lines closer than these, {step_hz:.3g} Hz apart, for what is "
            "far narrower"
        )
    if longest_s > response.provenance.segment_s:
        return (
            f"{told}; ask for a resolution of {rounded_up(1 / longest_s)} Hz, for what is far narrower than the "
            f"lines, {step_hz:.3g} Hz apart, drowns in its own leakage; or average longer"
        )
    return f"{told}; average longer, or look at a band where the coherence is better"


def _step_hz(response: FrequencyResponse) -> float:
    return float(response.frequency_hz[1] - response.frequency_hz[0])
