"""Effects in sensors, their cables, clocks and converters."""

from collections.abc import Callable

import numpy as np
from scipy.signal import bilinear, lfilter, sosfilt, sosfreqz

from chladni_withheld.networks.at_bodies import tone_signal
from chladni_withheld.networks.at_inputs import low_pass, low_pass_corner_hz
from chladni_withheld.networks.draft import Draft, Filter, Made, pick
from chladni_withheld.networks.machine import Addition, Rows
from chladni_withheld.networks.network import Matrix
from chladni_withheld.networks.scene import Rng, Scene


def _pick_output(rng: Rng, scene: Scene) -> tuple[str, float]:
    """An output's name and RMS."""
    row = int(rng.integers(len(scene.network.sensors)))
    return scene.network.sensors[row].name, float(scene.outputs_rms[row])


def _pick_smooth(rng: Rng, scene: Scene) -> str | None:
    row = pick(rng, scene.smooth_outputs)
    return None if row is None else scene.network.sensors[row].name


def _wired(name: str, change: Callable[[Matrix, float], Matrix], told: dict[str, float], response: Filter) -> Made:
    def wiring(rows: Rows, rate_hz: float) -> Rows:
        return rows | {name: change(rows[name], rate_hz)}

    return Made(Addition(wiring=wiring), told, response)


def _converted(name: str, change: Callable[[Matrix], Matrix], told: dict[str, float]) -> Made:
    return Made(Addition(converters={name: change}), told)


def gain_error(rng: Rng, scene: Scene) -> Draft:
    """A wrong sensitivity; one in four has the wrong sign or unit."""
    name, _ = _pick_output(rng, scene)
    sign = float(rng.choice([-1, 1]))
    fixed = float(rng.choice([-1.0, 9.80665, 1 / 9.80665])) if rng.random() < 0.25 else None

    def build(size: float) -> Made:
        gain = fixed if fixed is not None else max(1 + sign * size, 0.2)
        return _converted(name, lambda x: gain * x, {"gain": gain})

    return Draft("gain_error", "wrong sensitivity", name, build, (0.15, 0.01, 0.7), fixed=fixed is not None)


def cross_axis(rng: Rng, scene: Scene) -> Draft | None:
    """A sensor mounted askew: it feels what another one measures too."""
    pairs = _alike(scene)
    chosen = pick(rng, range(len(pairs)))
    if chosen is None:
        return None
    name, source = pairs[chosen] if rng.random() < 0.5 else pairs[chosen][::-1]
    sign = float(rng.choice([-1, 1]))
    rms = dict(zip((sensor.name for sensor in scene.network.sensors), scene.outputs_rms, strict=True))

    def build(size: float) -> Made:
        coefficient = sign * size * float(rms[name] / rms[source])

        def wiring(rows: Rows, _: float) -> Rows:
            return rows | {name: rows[name] + coefficient * rows[source]}

        return Made(Addition(wiring=wiring), {"coefficient": coefficient})

    return Draft("cross_axis", "mounted askew", name, build, (0.08, 0.005, 0.4), source=source)


def _alike(scene: Scene) -> list[tuple[str, str]]:
    """Pairs of sensors that measure the same at bodies."""
    sensors = [sensor for sensor in scene.network.sensors if sensor.where == "body"]
    return [
        (one.name, other.name)
        for number, one in enumerate(sensors)
        for other in sensors[number + 1 :]
        if one.measures == other.measures
    ]


def swapped_channels(rng: Rng, scene: Scene) -> Draft | None:
    """Two cables plugged into each other's socket."""
    pairs = _alike(scene)
    chosen = pick(rng, range(len(pairs)))
    if chosen is None:
        return None
    one, other = pairs[chosen]

    def build(_: float) -> Made:
        def wiring(rows: Rows, __: float) -> Rows:
            return rows | {one: rows[other], other: rows[one]}

        return Made(Addition(wiring=wiring), {})

    return Draft("swapped_channels", "two cables exchanged", f"{one}~{other}", build, (1.0, 1.0, 1.0), fixed=True)


def mounting_resonance(rng: Rng, scene: Scene) -> Draft | None:
    """A sensor on wax: the wax's damper and spring carry it, as a ground carries a mass."""
    name = _pick_smooth(rng, scene)
    if name is None:
        return None
    damping = rng.uniform(0.02, 0.2)

    def build(size: float) -> Made:
        frequency_hz = scene.band.high_hz / size
        omega = 2 * np.pi * frequency_hz
        above, below = [2 * damping * omega, omega**2], [1.0, 2 * damping * omega, omega**2]

        def ride(row: Matrix, rate_hz: float) -> Matrix:
            passed: Matrix = lfilter(*bilinear(above, below, rate_hz), row)
            return passed

        told = {"frequency_hz": frequency_hz, "damping_ratio": damping}
        return _wired(name, ride, told, lambda w: np.polyval(above, 1j * w) / np.polyval(below, 1j * w))

    return Draft("mounting_resonance", "on wax", name, build, (0.5, 0.1, 4.0))


def ac_coupling(rng: Rng, scene: Scene) -> Draft | None:
    """A capacitor and a resistor; the size is the corner over the lowest frequency of the band."""
    name = _pick_smooth(rng, scene)
    if name is None:
        return None

    def build(size: float) -> Made:
        corner_hz = size * scene.band.low_hz
        omega = 2 * np.pi * corner_hz

        def high_pass(row: Matrix, rate_hz: float) -> Matrix:
            passed: Matrix = lfilter(*bilinear([1.0, 0.0], [1.0, omega], rate_hz), row)
            return passed

        return _wired(name, high_pass, {"corner_hz": corner_hz}, lambda w: 1j * w / (1j * w + omega))

    return Draft("ac_coupling", "capacitor and resistor", name, build, (0.3, 0.02, 4.0))


def anti_alias(rng: Rng, scene: Scene) -> Draft | None:
    """A low-pass in one channel that the others don't have."""
    name = _pick_smooth(rng, scene)
    if name is None:
        return None
    order, family = int(rng.integers(4, 9)), str(rng.choice(["Butterworth", "Bessel", "Chebyshev"]))

    def build(size: float) -> Made:
        corner_hz, rate_hz = low_pass_corner_hz(scene, size), 1 / scene.grid.step_s
        sections = low_pass(order, family, corner_hz, rate_hz)

        def smooth(row: Matrix, _: float) -> Matrix:
            passed: Matrix = sosfilt(sections, row)
            return passed

        told = {"corner_hz": corner_hz, "order": float(order)}
        return _wired(name, smooth, told, lambda w: sosfreqz(sections, w / rate_hz)[1])

    return Draft("anti_alias", f"{family}, only in this channel", name, build, (0.5, 0.1, 8.0))


def time_offset(rng: Rng, scene: Scene) -> Draft | None:
    """A channel sampled late or early, its trigger a little uneven; the size is in samples."""
    name = _pick_smooth(rng, scene)
    if name is None:
        return None
    sign = float(rng.choice([-1, 1]))
    jitter = 0.002 * rng.standard_normal(scene.grid.samples)

    def build(size: float) -> Made:
        # A channel that is late shows at its stamp what was before.
        late_s = sign * size / scene.grid.rate_hz
        clocks = {name: lambda times_s: times_s - late_s + jitter / scene.grid.rate_hz}
        return Made(Addition(clocks=clocks), {"offset": late_s}, lambda w: np.exp(-1j * w * late_s))

    return Draft("time_offset", "late or early, uneven trigger", name, build, (0.5, 0.02, 6.0))


def clock_drift(rng: Rng, scene: Scene) -> Draft | None:
    """A recorder whose quartz has another rate, which warmth changes a little on the way; the size is in ppm."""
    name = _pick_smooth(rng, scene)
    if name is None:
        return None
    sign, bent, offset_s = float(rng.choice([-1, 1])), rng.uniform(-0.1, 0.1), rng.uniform(-0.3, 0.3)
    late_s = offset_s / scene.grid.rate_hz

    def build(size: float) -> Made:
        share = sign * size * 1e-6

        def clock(times_s: Matrix) -> Matrix:
            drifted: Matrix = times_s * (1 - share * (1 + bent * times_s / scene.grid.duration_s)) - late_s
            return drifted

        told = {"ppm": sign * size, "offset": late_s}
        return Made(Addition(clocks={name: clock}), told)

    per_sample = 1e6 / scene.grid.samples
    return Draft("clock_drift", "quartz that warms", name, build, (per_sample, 0.3 * per_sample, 20 * per_sample))


def clipping(rng: Rng, scene: Scene) -> Draft:
    """A converter at its range's end; the size is the RMS over the range."""
    name, rms = _pick_output(rng, scene)
    shift = rng.uniform(-0.1, 0.1)

    def build(size: float) -> Made:
        limit = rms / size
        low, high = (shift - 1) * limit, (shift + 1) * limit
        return _converted(name, lambda x: x.clip(low, high), {"limit": limit})

    return Draft("clipping", "range's end, not quite in the middle", name, build, (0.5, 0.3, 1.2))


def quantization(rng: Rng, scene: Scene) -> Draft:
    """A converter of few steps; the size is a step over the RMS."""
    name, rms = _pick_output(rng, scene)
    shift = rng.uniform(-0.5, 0.5)

    def build(size: float) -> Made:
        step = size * rms
        return _converted(name, lambda x: step * (np.round(x / step + shift) - shift), {"step": step})

    return Draft("quantization", "few steps", name, build, (0.4, 0.02, 1.5))


def offset(rng: Rng, scene: Scene) -> Draft:
    """A bridge out of balance."""
    name, rms = _pick_output(rng, scene)
    sign = float(rng.choice([-1, 1]))

    def build(size: float) -> Made:
        value = sign * size * rms
        return _converted(name, lambda x: x + value, {"value": value})

    return Draft("offset", "bridge out of balance", name, build, (0.2, 0.005, 2.0))


def output_tone(rng: Rng, scene: Scene) -> Draft:
    """Mains hum in one sensor's cable."""
    name, rms = _pick_output(rng, scene)
    modes_hz = scene.network.modes_hz()
    frequency_hz = rng.uniform(modes_hz[0], modes_hz[-1])
    tone = tone_signal(rng, scene, np.arange(scene.grid.samples) / scene.grid.rate_hz, frequency_hz)

    def build(size: float) -> Made:
        amplitude = size * rms
        told = {"frequency_hz": frequency_hz, "amplitude": amplitude}
        return _converted(name, lambda x: x + amplitude * tone, told)

    return Draft("tonal_disturbance", "hum in a cable", name, build, (0.1, 0.003, 2.0))
