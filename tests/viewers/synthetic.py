"""A study with known contents: two modes, three accelerometers and a force, all in closed form."""

from dataclasses import replace
from functools import cache

import numpy as np

from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Channel
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.geometry import Geometry, Point
from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.signals.waterfall import Waterfall

RATE_HZ = 256.0
SEGMENT_S = 4.0
DURATION_S = 40.0
START_NS = 1_700_000_000_000_000_000
PEAK_HZ = 12.5
SECOND_PEAK_HZ = 31.0
DAMPING = (0.02, 0.012)
SHAPES = np.array([[0.35, -0.6], [0.7, -0.2], [1.0, 0.8]])  # [channel, mode]
FORCE_DENSITY = 4.0  # N^2/Hz

FORCE = Channel(name="/hammer.wrench.force.x", unit="N", point="wrist", direction=(1.0, 0.0, 0.0), role="reference")
RESPONSES = tuple(
    Channel(name=f"/{point}.accel.linear.x", unit="m/s^2", point=point, direction=(1.0, 0.0, 0.0))
    for point in ("column", "arm", "wrist")
)
GEOMETRY = Geometry(
    points=(
        Point(name="base", position=(0.0, 0.0, 0.0)),
        Point(name="column", position=(0.0, 0.0, 0.4)),
        Point(name="arm", position=(0.3, 0.0, 0.8)),
        Point(name="wrist", position=(0.6, 0.1, 0.85)),
    ),
    lines=(("base", "column", "arm", "wrist"),),
)
PROVENANCE = Provenance(
    estimator="PSD", window="hann", segment_s=SEGMENT_S, overlap=0.5, averages=19, effective_averages=17.4
)


def accelerance(frequency_hz: Real) -> Complex:
    """[response, frequency] of the two-mode structure, force at the wrist."""
    omega = 2 * np.pi * frequency_hz
    total = np.zeros((3, frequency_hz.size), dtype=np.complex128)
    for mode, (natural_hz, damping) in enumerate(zip((PEAK_HZ, SECOND_PEAK_HZ), DAMPING, strict=True)):
        natural = 2 * np.pi * natural_hz
        gain = -(omega**2) / (natural**2 - omega**2 + 2j * damping * natural * omega)
        total += np.outer(SHAPES[:, mode] * SHAPES[2, mode], gain)
    return total


def frequencies() -> Real:
    return np.arange(int(RATE_HZ * SEGMENT_S / 2) + 1) / SEGMENT_S


@cache
def time_series() -> TimeSeries:
    rng = np.random.default_rng(1787)
    samples = int(RATE_HZ * DURATION_S)
    force = rng.standard_normal(samples) * np.sqrt(FORCE_DENSITY * RATE_HZ / 2)
    spectrum = np.fft.rfft(force)
    responses = np.fft.irfft(accelerance(np.fft.rfftfreq(samples, 1 / RATE_HZ)) * spectrum, samples)
    values = np.vstack([force[None], responses])
    return TimeSeries(values=values, sample_rate_hz=RATE_HZ, start_time_ns=START_NS, channels=(FORCE, *RESPONSES))


@cache
def density() -> PowerSpectralDensity:
    f = frequencies()
    values = np.vstack([np.full((1, f.size), FORCE_DENSITY), np.abs(accelerance(f)) ** 2 * FORCE_DENSITY])
    return PowerSpectralDensity(
        frequency_hz=f,
        values=values,
        std=values / np.sqrt(PROVENANCE.effective_averages),
        channels=(FORCE, *RESPONSES),
        bandwidth_hz=1.5 / SEGMENT_S,
        provenance=PROVENANCE,
    )


@cache
def waterfall() -> Waterfall:
    f = frequencies()
    time_s = SEGMENT_S / 2 + np.arange(10) * SEGMENT_S
    level = 1 + 0.5 * np.sin(2 * np.pi * time_s / DURATION_S)
    values = density().values[:, None, :] * level[None, :, None]
    return Waterfall(
        time_s=time_s,
        frequency_hz=f,
        values=values,
        channels=(FORCE, *RESPONSES),
        start_time_ns=START_NS,
        bandwidth_hz=1.5 / SEGMENT_S,
        provenance=replace(PROVENANCE, averages=1, effective_averages=1.0),
    )


@cache
def frequency_response() -> FrequencyResponse:
    """Excited from 2 to 100 Hz only; outside there's garbage that no picture may show."""
    f = frequencies()
    excited = (f >= 2) & (f <= 100)
    values = accelerance(f)[:, None, :]
    coherence = np.clip(0.999 - 0.3 / (1 + np.abs(values[:, 0]) * 50), 0, 1)
    std = np.abs(values) * np.sqrt((1 - coherence) / (2 * coherence * 17.4))[:, None, :]
    return FrequencyResponse(
        frequency_hz=f,
        values=np.where(excited, values, 1e6),
        std=std,
        coherence=coherence,
        excited=excited,
        responses=RESPONSES,
        references=(FORCE,),
        provenance=PROVENANCE.with_estimator("H1"),
    )


def peaks() -> tuple[Peak, ...]:
    f, psd = frequencies(), density()
    found = []
    for hertz in (PEAK_HZ, SECOND_PEAK_HZ):
        line = int(np.argmin(np.abs(f - hertz)))
        rows = [row for row, channel in enumerate(psd.channels) if channel.unit == "m/s^2"]
        rows.sort(key=lambda row: -psd.values[row, line])
        found.append(
            Peak(
                frequency_hz=hertz,
                frequency_std_hz=0.021,
                height=float(psd.values[rows[0], line]),
                height_std=float(psd.std[rows[0], line]),
                unit="(m/s^2)^2/Hz",
                channels=tuple(psd.channels[row].name for row in rows),
            )
        )
    return tuple(found)


def response_peaks() -> tuple[Peak, ...]:
    response = frequency_response()
    line = int(np.argmin(np.abs(response.frequency_hz - PEAK_HZ)))
    return (
        Peak(
            frequency_hz=PEAK_HZ,
            frequency_std_hz=0.021,
            height=float(np.abs(response.values[2, 0, line])),
            height_std=float(response.std[2, 0, line]),
            unit="(m/s^2)/N",
            channels=(RESPONSES[2].name, FORCE.name),
        ),
    )


@cache
def study() -> Study:
    return Study(
        title="arm.mcap",
        series=(time_series(),),
        densities=(density(),),
        waterfalls=(waterfall(),),
        response=frequency_response(),
        peaks=peaks(),
        response_peaks=response_peaks(),
        geometry=GEOMETRY,
        findings=(
            "The log is sound: 4 channels, 256 Hz, 40 s, no gaps, nothing clipped.",
            "Two resonances stand out, at 12.5 Hz and 31 Hz.",
            "/hammer excites from 2 to 100 Hz; lines outside are masked.",
        ),
    )


HOSTILE_NAMES = (
    '/log{name=="a/b"}.value',
    "/joint_states.position[elbow]",
    "/a b/'quoted'.x",
    "/<script>alert(1)</script>.x",
    "/$cost_{x}$.%s\\n",
    "_hidden.é\n.y",
    "**/+ /everything",
    "/__properties/#1",
)


@cache
def hostile_study() -> Study:
    """The same measurement repeated under names that try to break paths, markup and mathematics."""
    base = time_series()
    channels = tuple(Channel(name=name, unit="m/s^2") for name in HOSTILE_NAMES)
    rows = np.arange(len(channels)) % 4
    psd, response, slices = density(), frequency_response(), waterfall()
    return Study(
        title="<b>bad</b> $x$.mcap",
        series=(replace(base, values=base.values[rows], channels=channels),),
        densities=(replace(psd, values=psd.values[rows], std=psd.std[rows], channels=channels),),
        waterfalls=(replace(slices, values=slices.values[rows], channels=channels),),
        response=replace(
            response,
            values=response.values[rows[:7] % 3],
            std=response.std[rows[:7] % 3],
            coherence=response.coherence[rows[:7] % 3],
            responses=channels[1:],
            references=channels[:1],
        ),
        peaks=(replace(peaks()[0], channels=(HOSTILE_NAMES[3], HOSTILE_NAMES[4])),),
        findings=("channel /<script>alert(1)</script>.x is dead; ![x](http://localhost/x.png) **not bold**",),
    )
