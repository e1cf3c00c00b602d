"""Hypothesis strategies for the project's own types; every value drawn satisfies its type's rules."""

from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import AXES, Channel
from chladni.signals.coherence import Coherence
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.geometry import Geometry, Point
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.modal_fit import ModalFit
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.order_spread import OrderSpread
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.stabilisation_diagram import POLE_STATUSES, StabilisationDiagram
from chladni.signals.time_series import TimeSeries
from chladni.signals.waterfall import Waterfall

SI_UNITS = ("m/s^2", "N", "m", "m/s", "V", "rad/s", "Pa", "N m", "1", "V/(m/s^2)", "N s/m", "(m/s^2)/N", "m/(A V)")
USER_UNITS = (
    *SI_UNITS,
    "g",
    "mg",
    "mm/s^2",
    "m/s2",
    "m/s²",
    "in/s",
    "lbf",
    "kN/mm",
    "mV/g",
    "deg/s",
    "rpm",
    "psi",
    "%",
)

names = st.from_regex(r"/[a-z]{1,6}\.[a-z]{1,6}", fullmatch=True)
si_units = st.sampled_from(SI_UNITS)
user_units = st.sampled_from(USER_UNITS)
rates_hz = st.sampled_from((0.5, 10.0, 100.0, 400.0, 610.35, 1000.0, 25_600.0, 51_200.0))
start_times_ns = st.integers(0, 2_000_000_000_000_000_000)
amplitudes = st.floats(-1e6, 1e6, allow_subnormal=False)
positive = st.floats(0.0, 1e6, allow_subnormal=False)


@st.composite
def channels(draw: st.DrawFn, *, name: str | None = None) -> Channel:
    """One channel, with or without a place and a limit."""
    return Channel(
        name=draw(names) if name is None else name,
        unit=draw(si_units),
        point=draw(st.none() | st.sampled_from(("base", "arm", "wrist"))),
        direction=draw(st.none() | st.sampled_from(tuple(AXES.values()))),
        role=draw(st.sampled_from(("response", "reference"))),
        overload=draw(st.none() | st.floats(1e-3, 1e6)),
    )


@st.composite
def channel_tuples(draw: st.DrawFn, *, count: int) -> tuple[Channel, ...]:
    """Channels with different names."""
    chosen = draw(st.lists(names, min_size=count, max_size=count, unique=True))
    return tuple(draw(channels(name=name)) for name in chosen)


def reals(shape: tuple[int, ...], elements: st.SearchStrategy[float] = amplitudes) -> st.SearchStrategy[Any]:
    """Float64 arrays of a shape."""
    return hnp.arrays(np.float64, shape, elements=elements)


@st.composite
def complexes(draw: st.DrawFn, shape: tuple[int, ...]) -> Complex:
    """Complex128 arrays of a shape."""
    array: Complex = draw(reals(shape)) + 1j * draw(reals(shape))
    return array


@st.composite
def time_series(
    draw: st.DrawFn, *, max_channels: int = 3, min_samples: int = 1, max_samples: int = 64, gaps: bool = True
) -> TimeSeries:
    """Series of one to three channels, with marked gaps when `gaps`."""
    count = draw(st.integers(1, max_channels))
    samples = draw(st.integers(min_samples, max_samples))
    values = draw(reals((count, samples))).astype(draw(st.sampled_from((np.float32, np.float64))))
    valid = draw(hnp.arrays(np.bool_, values.shape)) if gaps and draw(st.booleans()) else None
    if valid is not None:
        values = np.where(valid, values, np.nan)
    return TimeSeries(
        values=values,
        sample_rate_hz=draw(rates_hz),
        start_time_ns=draw(start_times_ns),
        channels=draw(channel_tuples(count=count)),
        valid=valid,
    )


@st.composite
def frequency_axes(draw: st.DrawFn, *, max_lines: int = 9) -> Real:
    """Evenly spaced axes from 0 Hz."""
    axis: Real = np.arange(float(draw(st.integers(1, max_lines)))) * draw(st.sampled_from((0.25, 1.0, 12.5)))
    return axis


@st.composite
def provenances(draw: st.DrawFn) -> Provenance:
    """An account of a linear average."""
    averages = draw(st.integers(1, 1000))
    return Provenance(
        estimator=draw(st.sampled_from(("PSD", "H1", "H2", "Hv"))),
        window=draw(st.sampled_from(("hann", "boxcar", "flattop"))),
        segment_s=draw(st.floats(1e-3, 100.0)),
        overlap=draw(st.sampled_from((0.0, 0.5, 0.75))),
        averages=averages,
        effective_averages=averages * draw(st.floats(0.3, 1.0)),
    )


@st.composite
def hermitian_densities(draw: st.DrawFn, count: int, lines: int) -> Complex:
    """``[channel, channel, frequency]``, Hermitian and positive semidefinite: sums of conj(x) x^T."""
    spectra = draw(complexes((draw(st.integers(1, count + 2)), count, lines)))
    density: Complex = np.einsum("sif,sjf->ijf", spectra.conj(), spectra)
    return density


@st.composite
def cross_spectra(draw: st.DrawFn, *, max_channels: int = 3) -> CrossSpectra:
    """Averaged matrices of cross-spectra, with noise from period to period now and then."""
    count = draw(st.integers(1, max_channels))
    frequency_hz = draw(frequency_axes())
    noise = draw(hermitian_densities(count, frequency_hz.size)) if draw(st.booleans()) else None
    return CrossSpectra(
        frequency_hz=frequency_hz,
        density=draw(hermitian_densities(count, frequency_hz.size)),
        channels=draw(channel_tuples(count=count)),
        bandwidth_hz=draw(st.floats(1e-3, 100.0)),
        noise_density=noise,
        provenance=draw(provenances()),
    )


@st.composite
def power_spectral_densities(draw: st.DrawFn, *, max_channels: int = 3) -> PowerSpectralDensity:
    """Auto-spectral densities."""
    count = draw(st.integers(1, max_channels))
    frequency_hz = draw(frequency_axes())
    return PowerSpectralDensity(
        frequency_hz=frequency_hz,
        values=draw(reals((count, frequency_hz.size), positive)),
        std=draw(reals((count, frequency_hz.size), positive)),
        channels=draw(channel_tuples(count=count)),
        bandwidth_hz=draw(st.floats(1e-3, 100.0)),
        provenance=draw(provenances()),
    )


@st.composite
def frequency_responses(draw: st.DrawFn, *, max_channels: int = 4) -> FrequencyResponse:
    """Responses over one or more references."""
    everything = draw(channel_tuples(count=draw(st.integers(2, max_channels))))
    inputs = draw(st.integers(1, len(everything) - 1))
    references, responses = everything[:inputs], everything[inputs:]
    frequency_hz = draw(frequency_axes())
    shape = (len(responses), len(references), frequency_hz.size)
    return FrequencyResponse(
        frequency_hz=frequency_hz,
        values=draw(complexes(shape)),
        std=draw(reals(shape, positive)),
        coherence=draw(reals((shape[0], shape[2]), st.floats(0.0, 1.0))),
        excited=draw(hnp.arrays(np.bool_, frequency_hz.size)),
        responses=responses,
        references=references,
        provenance=draw(provenances()),
    )


@st.composite
def coherences(draw: st.DrawFn, *, max_channels: int = 3) -> Coherence:
    """Ordinary coherences with one reference."""
    everything = draw(channel_tuples(count=draw(st.integers(2, max_channels + 1))))
    frequency_hz = draw(frequency_axes())
    shape = (len(everything) - 1, frequency_hz.size)
    return Coherence(
        frequency_hz=frequency_hz,
        values=draw(reals(shape, st.floats(0.0, 1.0))),
        std=draw(reals(shape, st.floats(0.0, 1.0))),
        kind="ordinary",
        responses=everything[1:],
        references=everything[:1],
        provenance=draw(provenances()),
    )


@st.composite
def waterfalls(draw: st.DrawFn, *, max_channels: int = 3) -> Waterfall:
    """Short-time densities."""
    count = draw(st.integers(1, max_channels))
    frequency_hz = draw(frequency_axes())
    times = draw(st.integers(1, 5))
    return Waterfall(
        time_s=np.arange(float(times)) * 0.5 + 0.25,
        frequency_hz=frequency_hz,
        values=draw(reals((count, times, frequency_hz.size), positive)),
        channels=draw(channel_tuples(count=count)),
        start_time_ns=draw(start_times_ns),
        bandwidth_hz=draw(st.floats(1e-3, 100.0)),
        provenance=draw(provenances()),
    )


@st.composite
def geometries(draw: st.DrawFn) -> Geometry:
    """Points with a line through all of them."""
    point_names = draw(st.lists(st.sampled_from(("base", "column", "arm", "wrist")), min_size=1, unique=True))
    coordinate = st.floats(-10.0, 10.0)
    points = tuple(Point(name=name, position=draw(st.tuples(*[coordinate] * 3))) for name in point_names)
    return Geometry(points=points, lines=(tuple(point_names),))


@st.composite
def modal_scales(draw: st.DrawFn, modes: int) -> ModalScale:
    """Modal masses of a driving point."""
    return ModalScale(
        response=draw(names),
        reference=draw(names),
        modal_a=draw(complexes((modes,))),
        modal_mass=draw(reals((modes,), st.floats(1e-3, 1e6))),
        modal_mass_std=draw(reals((modes,), positive)),
    )


@st.composite
def order_spreads(draw: st.DrawFn, modes: int) -> OrderSpread:
    """Scatter over model orders."""
    return OrderSpread(
        orders=draw(hnp.arrays(np.int64, modes, elements=st.integers(1, 100))),
        frequency_hz=draw(reals((modes,), st.floats(0.1, 1e4))),
        frequency_std_hz=draw(reals((modes,), positive)),
        damping_ratio=draw(reals((modes,), st.floats(0.0, 1.0))),
        damping_std=draw(reals((modes,), st.floats(0.0, 1.0))),
    )


@st.composite
def modal_fits(draw: st.DrawFn, responses: int, references: int, *, modes: int = 1) -> ModalFit:
    """Synthesised functions, with one band for each mode."""
    frequency_hz = draw(frequency_axes())
    functions = (responses, references)
    edges = np.linspace(0.0, max(float(frequency_hz[-1]), 1.0), modes + 1)
    return ModalFit(
        frequency_hz=frequency_hz,
        synthesised=draw(complexes((*functions, frequency_hz.size))),
        lower_residual=draw(complexes(functions)),
        upper_residual=draw(complexes(functions)),
        error=draw(st.floats(0.0, 1.0)),
        function_error=draw(reals(functions, st.floats(0.0, 1.0))),
        bands_hz=np.stack([edges[:-1], edges[1:]], axis=1),
        band_error=draw(reals((modes,), st.floats(0.0, 1.0))),
        poles_hz=np.linspace(1.0, 10.0, modes),
    )


@st.composite
def stabilisation_diagrams(draw: st.DrawFn, modes: int) -> StabilisationDiagram:
    """Poles over orders, under one or two curves."""
    poles = draw(st.integers(0, 8))
    axis = draw(frequency_axes())
    return StabilisationDiagram(
        order=np.sort(draw(hnp.arrays(np.int64, poles, elements=st.integers(2, 60)))),
        frequency_hz=draw(reals((poles,), st.floats(0.1, 1e3))),
        damping_ratio=draw(reals((poles,), st.floats(1e-4, 0.5))),
        status=draw(hnp.arrays(np.int64, poles, elements=st.integers(0, len(POLE_STATUSES) - 1))),
        mode=draw(hnp.arrays(np.int64, poles, elements=st.integers(-1, modes - 1))),
        indicator_hz=axis,
        indicator=draw(reals((draw(st.integers(1, 2)), axis.size), positive)),
        indicator_name="CMIF",
        indicator_unit="(m/s^2)/N",
    )


@st.composite
def shape_arrays(draw: st.DrawFn, modes: int, columns: int) -> Complex:
    """``[mode, channel]`` complex shapes whose largest component is exactly 1."""
    part = reals((modes, columns), st.floats(-1.0, 1.0, width=32))
    raw = draw(part) + 1j * draw(part)
    rows = np.arange(modes)
    largest = np.argmax(np.abs(raw), axis=1) if modes else np.zeros(0, dtype=int)
    pivot = raw[rows, largest]
    raw[rows, largest] = pivot = np.where(np.abs(pivot) < 1e-3, 1.0, pivot)
    raw /= pivot[:, np.newaxis]
    raw[rows, largest] = 1.0
    return raw


@st.composite
def mode_sets(draw: st.DrawFn, *, min_modes: int = 0, max_modes: int = 4, max_channels: int = 4) -> ModeSet:
    """Modes with error bars; scale, scatter, fit and diagram now and then."""
    modes = draw(st.integers(min_modes, max_modes))
    inputs = draw(st.integers(0, 2))
    everything = draw(channel_tuples(count=inputs + draw(st.integers(1, max_channels))))
    references, responses = everything[:inputs], everything[inputs:]
    shapes = draw(shape_arrays(modes, len(responses)))
    spread_of_shapes = draw(reals((2, *shapes.shape), st.floats(0.0, 0.5)))
    rich = draw(st.booleans())
    scaled, fitted = rich and inputs > 0, rich and inputs > 0 and modes > 0
    return ModeSet(
        frequency_hz=np.sort(draw(reals((modes,), st.floats(0.1, 1e4)))),
        frequency_std_hz=draw(reals((modes,), st.floats(0.0, 10.0))),
        damping_ratio=draw(reals((modes,), st.floats(1e-5, 0.9))),
        damping_std=draw(reals((modes,), st.floats(0.0, 0.1))),
        shapes=shapes,
        shape_std=spread_of_shapes[0] + 1j * spread_of_shapes[1],
        channels=responses,
        references=references,
        participation=draw(complexes((modes, inputs))) if inputs else None,
        scale=draw(modal_scales(modes)) if scaled else None,
        spread=draw(order_spreads(modes)) if rich else None,
        harmonics=(MachineHarmonic(frequency_hz=50.0, reason="kurtosis 1.5"),) if draw(st.booleans()) else (),
        fit=draw(modal_fits(len(responses), inputs, modes=modes)) if fitted else None,
        stabilisation=draw(stabilisation_diagrams(modes)) if rich else None,
        provenance=draw(provenances()),
    )


@st.composite
def mode_validations(draw: st.DrawFn) -> ModeValidation:
    """Checks of up to four modes."""
    modes = draw(st.integers(0, 4))
    return ModeValidation(
        auto_mac=draw(reals((modes, modes), st.floats(0.0, 1.0))),
        mpc=draw(reals((modes,), st.floats(0.0, 1.0))),
        mpd_deg=draw(reals((modes,), st.floats(0.0, 90.0))),
        mean_phase_deg=draw(reals((modes,), st.floats(-90.0, 90.0))),
        alike=((0, 1),) if modes > 1 else (),
        findings=("something",),
    )
