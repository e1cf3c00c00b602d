"""Results as the JSON documents that programs rely on; NaN and infinity become null."""

from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chladni.signals.comparison import DensityComparison, LevelChange, PeakChange
from chladni.signals.cross_correlation import TimeDelays
from chladni.signals.deflection_shapes import DeflectionShapes
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.shock_response import ShockResponse
from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum
from chladni.spectral.bands import total_rms
from chladni.spectral.peaks import find_peaks, judged_above_hz

if TYPE_CHECKING:
    from chladni.apps.compare import LogComparison
    from chladni.apps.orders import OrderStudy
    from chladni.apps.tolerance import Tolerated

Document = dict[str, Any]


def plain(array: NDArray[Any]) -> list[Any]:
    """Turn a one-dimensional array into a list, with None where a number isn't finite.

    Examples
    --------
    >>> plain(np.array([1.0, np.nan]))
    [1.0, None]
    """
    numbers: list[Any] = array.tolist()
    if array.dtype.kind != "f" or bool(np.isfinite(array).all()):
        return numbers
    return [number if isfinite(number) else None for number in numbers]


def psd_document(densities: Sequence[PowerSpectralDensity]) -> Document:
    """Document of ``chladni psd``.

    The axis and averages of the first sampling grid stand at the top; channels of other grids carry their own under
    the same keys.
    """
    first = densities[0]
    channels = []
    for density in densities:
        own_axis = {} if density is first else _axis(density)
        channels += [_channel_density(density, row) | own_axis for row in range(len(density.channels))]
    notes = [note for density in densities for note in density.provenance.notes]
    return {"format": "chladni.psd/1", **_axis(first), "channels": channels, "notes": notes}


def frf_document(response: FrequencyResponse, peaks: Sequence[Peak]) -> Document:
    """Document of ``chladni frf``."""
    return {
        "format": "chladni.frf/1",
        **_axis(response),
        "estimator": response.provenance.estimator,
        "window_decay_per_s": response.provenance.window_decay_per_s,
        "functions": [
            _function(response, row, column, peaks)
            for row in range(len(response.responses))
            for column in range(len(response.references))
        ],
        "notes": list(response.provenance.notes),
    }


def shock_document(found: Sequence[ShockResponse]) -> Document:
    """Document of ``chladni srs``.

    The axis of the first sampling grid stands at the top; channels of other grids carry their own under the same key.
    """
    first = found[0]
    channels = []
    for response in found:
        own_axis = {} if response is first else {"frequency_hz": plain(response.frequency_hz)}
        # Worked out of all channels each time it's asked for.
        maximax = response.maximax
        channels += [
            {
                "name": channel.name,
                "unit": channel.unit,
                "maximax": plain(maximax[row]),
                "positive": plain(response.positive[row]),
                "negative": plain(response.negative[row]),
                "offset": finite(float(response.offset[row])),
                **own_axis,
            }
            for row, channel in enumerate(response.channels)
        ]
    return {
        "format": "chladni.srs/1",
        "frequency_hz": plain(first.frequency_hz),
        "quantity": first.quantity,
        "q": first.q,
        "channels": channels,
        "notes": list(dict.fromkeys(note for response in found for note in response.notes)),
    }


def orders_document(found: "OrderStudy") -> Document:
    """Document of ``chladni orders``; each sampling grid has points of its own."""
    return {
        "format": "chladni.orders/1",
        "rotation": found.rotation.source,
        "method": found.cuts[0].method,
        "orders": plain(found.cuts[0].orders),
        "grids": [
            {
                "time_s": plain(cuts.time_s),
                "speed_hz": plain(cuts.speed_hz),
                "channels": [
                    {
                        "name": channel.name,
                        "unit": channel.unit,
                        "cuts": [
                            {
                                "order": order,
                                "amplitude": plain(np.abs(cuts.values[row, place])),
                                "phase_deg": plain(np.angle(cuts.values[row, place], deg=True)),
                            }
                            for place, order in enumerate(cuts.orders.tolist())
                        ],
                    }
                    for row, channel in enumerate(cuts.channels)
                ],
            }
            for cuts in found.cuts
        ],
        "notes": list(found.rotation.notes),
    }


def delay_document(found: TimeDelays) -> Document:
    """Document of ``chladni delay``."""
    return {
        "format": "chladni.delay/1",
        "reference": found.reference.name,
        "band_hz": list(found.band_hz),
        "delays": [
            {
                "response": channel.name,
                "delay_s": finite(float(found.delay_s[row])),
                "std_s": finite(float(found.std_s[row])),
                "coherence": finite(float(found.coherence[row])),
                "inverted": found.inverted[row],
            }
            for row, channel in enumerate(found.responses)
        ],
        "notes": list(found.notes),
    }


def deflection_document(found: DeflectionShapes) -> Document:
    """Document of ``chladni ods``."""
    return {
        "format": "chladni.ods/1",
        "reference": found.reference,
        "bandwidth_hz": found.bandwidth_hz,
        "shapes": [
            {
                "frequency_hz": frequency_hz,
                "shape": [
                    {
                        "channel": channel.name,
                        "unit": channel.unit,
                        "rms": finite(float(abs(found.values[row, column]))),
                        "std": finite(float(found.std[row, column])),
                        "phase_deg": finite(float(np.angle(found.values[row, column], deg=True))),
                        "coherence": finite(float(found.coherence[row, column])),
                    }
                    for column, channel in enumerate(found.channels)
                ],
            }
            for row, frequency_hz in enumerate(found.frequency_hz.tolist())
        ],
        "notes": list(found.provenance.notes),
    }


def tolerance_document(found: "Sequence[Tolerated]") -> Document:
    """Document of ``chladni tolerance``; each sampling grid has lines of its own."""
    profile = found[0].check.profile
    return {
        "format": "chladni.tolerance/1",
        "unit": profile.unit,
        "profile": [
            {"frequency_hz": frequency_hz, "psd": psd}
            for frequency_hz, psd in zip(profile.frequency_hz.tolist(), profile.density.tolist(), strict=True)
        ],
        "profile_rms": profile.rms(),
        "upper_db": profile.upper_db,
        "lower_db": profile.lower_db,
        "channels": [
            {
                "name": channel.name,
                "rms": finite(float(one.check.rms[row])),
                "outside": finite(float(one.check.outside[row])),
                "std_db": finite(float(one.check.std_db[row])),
                "frequency_hz": plain(one.check.frequency_hz),
                "deviation_db": plain(one.check.deviation_db[row]),
            }
            for one in found
            for row, channel in enumerate(one.check.channels)
        ],
        "notes": [note for one in found for note in one.density.provenance.notes],
    }


def zoom_document(found: Sequence[AmplitudeSpectrum]) -> Document:
    """Document of ``chladni zoom``; all sampling grids have the same lines."""
    return {
        "format": "chladni.zoom/1",
        "frequency_hz": plain(found[0].frequency_hz),
        "quantity": found[0].quantity,
        "window": found[0].provenance.window,
        "channels": [
            {"name": channel.name, "unit": channel.unit, "amplitude": plain(one.values[row])}
            for one in found
            for row, channel in enumerate(one.channels)
        ],
        "notes": list(dict.fromkeys(note for one in found for note in one.provenance.notes)),
    }


def comparison_document(comparison: "LogComparison") -> Document:
    """Document of ``chladni compare``."""
    response = comparison.response
    return {
        "format": "chladni.compare/1",
        "levels": [_level_change(one) for density in comparison.densities for one in density.overall],
        "bands": [_level_change(one) for density in comparison.densities for one in density.bands],
        "peaks": [_peak_change(one) for density in comparison.densities for one in density.peaks],
        "response_peaks": [] if response is None else [_peak_change(one) for one in response.peaks],
        "modes": None if comparison.modes is None else [asdict(one) for one in comparison.modes],
        "spectra": [_density_change(density, row) for density in comparison.densities for row in _rows(density)],
        "notes": [*comparison.notes, *(note for density in comparison.densities for note in density.notes)],
    }


def _rows(density: DensityComparison) -> range:
    return range(len(density.channels))


def _density_change(density: DensityComparison, row: int) -> Document:
    return {
        "name": density.channels[row].name,
        "frequency_hz": plain(density.frequency_hz),
        "change_db": plain(density.change_db[row]),
        "change_std_db": plain(density.change_std_db[row]),
        "significant": plain(density.significant[row]),
    }


def _level_change(change: LevelChange) -> Document:
    return {name: finite(value) if isinstance(value, float) else value for name, value in asdict(change).items()}


def _peak_change(change: PeakChange) -> Document:
    return {
        "fate": change.fate,
        "channels": list(change.channels),
        "before_hz": None if change.before is None else change.before.frequency_hz,
        "after_hz": None if change.after is None else change.after.frequency_hz,
        "shift_hz": finite(change.shift_hz),
        "shift_std_hz": finite(change.shift_std_hz),
    }


def _axis(estimate: PowerSpectralDensity | FrequencyResponse) -> Document:
    account = estimate.provenance
    return {
        "frequency_hz": plain(estimate.frequency_hz),
        "averages": account.averages,
        "effective_averages": account.effective_averages,
        "window": account.window,
        "segment_s": account.segment_s,
        "averaging": account.averaging,
        "judged_above_hz": judged_above_hz(estimate),
    }


def _channel_density(density: PowerSpectralDensity, row: int) -> Document:
    alone = density.rows([row])
    return {
        "name": alone.channels[0].name,
        "channel_unit": alone.channels[0].unit,
        "psd_unit": alone.units[0],
        "psd": plain(alone.values[0]),
        "std": plain(alone.std[0]),
        "peaks": [
            {
                "frequency_hz": peak.frequency_hz,
                "frequency_std_hz": finite(peak.frequency_std_hz),
                "psd": peak.height,
                "psd_std": finite(peak.height_std),
            }
            for peak in find_peaks(alone)
        ],
        "rms": finite(float(total_rms(alone).rms[0, 0])),
    }


def _function(response: FrequencyResponse, row: int, column: int, peaks: Sequence[Peak]) -> Document:
    names = (response.responses[row].name, response.references[column].name)
    values = response.values[row, column]
    return {
        "response": names[0],
        "reference": names[1],
        "unit": response.unit(row, column),
        "real": plain(values.real),
        "imag": plain(values.imag),
        "std": plain(response.std[row, column]),
        "coherence": plain(response.coherence[row]),
        "excited": plain(response.excited),
        "peaks": [
            {
                "frequency_hz": peak.frequency_hz,
                "frequency_std_hz": finite(peak.frequency_std_hz),
                "magnitude": peak.height,
                "magnitude_std": finite(peak.height_std),
            }
            for peak in peaks
            if peak.channels == names
        ],
    }


def finite(number: float) -> float | None:
    """Give the number, or None when it isn't finite."""
    return number if isfinite(number) else None
