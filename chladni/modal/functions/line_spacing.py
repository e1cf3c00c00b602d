"""How close spectral lines can lie, and what to ask for where a resonance is narrower than they tell."""

from chladni.signals.frequency_response import FrequencyResponse

# Segments of a record, end to end, that modes are identified from: half as many as a spectrum for the eye has, twice
# the lines in each peak. Each further reference takes some of the averages for itself.
SEGMENTS, SEGMENTS_A_REFERENCE = 8, 4
LONGEST_SEGMENT = 1 << 16
# Half-power widths in lines below which the damping rests on the window as much as on the structure.
COARSE = 2.0


def longest_segment_s(response: FrequencyResponse) -> float:
    """Longest segment that leaves enough averages for modes, 0 where the functions aren't averages of segments."""
    account = response.provenance
    if account.averaging != "linear" or not account.averages:
        return 0.0
    hop_s = account.segment_s * (1 - account.overlap)
    duration_s = account.segment_s + (account.averages - 1) * hop_s
    segments = SEGMENTS + SEGMENTS_A_REFERENCE * (len(response.references) - 1)
    rate_hz = 2 * float(response.frequency_hz[-1])
    return min(duration_s / segments, LONGEST_SEGMENT / rate_hz)


def closer_lines(response: FrequencyResponse, width_hz: float) -> str:
    """Say how to get lines on which a half-power width of so many hertz can be judged."""
    account = response.provenance
    wanted_hz = width_hz / COARSE
    step_hz = float(response.frequency_hz[1] - response.frequency_hz[0])
    if account.averaging == "periodic":
        return f"a period {_times(step_hz / wanted_hz)} as long or more helps"
    longest_s = longest_segment_s(response)
    if not longest_s:
        return f"lines {wanted_hz:.2g} Hz apart or closer help, from records {_times(step_hz / wanted_hz)} as long"
    if longest_s * wanted_hz >= 1:
        return f"ask for a resolution of {wanted_hz:.2g} Hz or finer"
    record = f"a record {_times(1 / (longest_s * wanted_hz))} as long helps"
    finer = longest_s > account.segment_s
    return f"ask for a resolution of {1 / longest_s:.2g} Hz; {record} further" if finer else record


def nothing_found(response: FrequencyResponse) -> str:
    """Say that there is no mode, and what to try where one may hide."""
    step_hz = float(response.frequency_hz[1] - response.frequency_hz[0])
    account, longest_s = response.provenance, longest_segment_s(response)
    told = "no mode: no pole is both found at enough model orders and needed to explain the functions"
    if not account.averages:
        return (
            f"{told}; look at another band, or measure lines closer than these, {step_hz:.3g} Hz apart, for what is "
            "far narrower"
        )
    if longest_s > account.segment_s:
        return (
            f"{told}; ask for a resolution of {1 / longest_s:.2g} Hz, for what is far narrower than the lines, "
            f"{step_hz:.3g} Hz apart, drowns in its own leakage; or average longer"
        )
    return f"{told}; average longer, or look at a band where the coherence is better"


def _times(factor: float) -> str:
    return f"{factor:.0f} times" if factor >= 10 else f"{factor:.2g} times"
