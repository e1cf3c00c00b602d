"""Effects between a command and its force, and in the channel that records an input."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.signal import bessel, butter, cheby1, cont2discrete, lfilter, sosfilt

from chladni_withheld.networks import laws
from chladni_withheld.networks.draft import Draft, Filter, Made, pick
from chladni_withheld.networks.excitation import Signal
from chladni_withheld.networks.machine import Addition, Element
from chladni_withheld.networks.network import GROUND, Matrix
from chladni_withheld.networks.scene import Rng, Scene

Sizes = tuple[float, float, float]
Change = Callable[[Signal], Signal]


def _pick_actuator(rng: Rng, scene: Scene) -> int | None:
    """An input that is a force; a shaken ground has no actuator that this model knows."""
    drives = scene.network.drives
    return pick(rng, tuple(row for row, drive in enumerate(drives) if drive.where != "ground"))


def _acts(site: str, change: Change, told: dict[str, float], response: Filter | None = None) -> Made:
    return Made(Addition(actuators={site: change}), told, response=response)


def _pointwise(site: str, function: Callable[[Matrix], Matrix], told: dict[str, float]) -> Made:
    return _acts(site, lambda signal: replace(signal, values=function(signal.values)), told)


def delay(rng: Rng, scene: Scene) -> Draft | None:
    """A true dead time, of any part of a sample."""
    number = _pick_actuator(rng, scene)
    if number is None:
        return None
    site, half_step_s = scene.network.drives[number].name, 0.5 * scene.grid.step_s

    def build(size: float) -> Made:
        shift = max(round(size / scene.grid.rate_hz / half_step_s), 1)
        late_s = shift * half_step_s

        def later(signal: Signal) -> Signal:
            return replace(signal, values=np.append(np.zeros(shift), signal.values[:-shift]))

        return _acts(site, later, {"delay": late_s}, lambda omega: np.exp(-1j * omega * late_s))

    return Draft("delay", "dead time", site, build, (1.0, 0.1, 12.0))


def lag(rng: Rng, scene: Scene) -> Draft | None:
    """A coil, of first order, or a controlled current, of second; the size is its time in samples."""
    number = _pick_actuator(rng, scene)
    if number is None:
        return None
    site = scene.network.drives[number].name
    controlled = rng.random() < 0.5
    damping = rng.uniform(0.6, 1.1)

    def build(size: float) -> Made:
        time_s = size / scene.grid.rate_hz
        below = np.array([time_s**2, 2 * damping * time_s, 1.0]) if controlled else np.array([time_s, 1.0])
        told = {"time_constant": time_s, "order": 1.0 + controlled}

        def slower(signal: Signal) -> Signal:
            return filtered(signal, np.array([1.0]), below, 0.5 * scene.grid.step_s)

        return _acts(site, slower, told, lambda omega: 1 / np.polyval(below, 1j * omega))

    law = "controlled current" if controlled else "coil"
    return Draft("lag", law, site, build, (1.0, 0.2, 30.0))


def filtered(signal: Signal, above: Matrix, below: Matrix, step_s: float) -> Signal:
    """Pass a signal through above(s)/below(s): exactly for one that jumps, else to the second order in the step."""
    numerator, denominator, _ = cont2discrete((above, below), step_s, method="zoh" if signal.jumps else "bilinear")
    values: Matrix = lfilter(np.ravel(numerator), denominator, signal.values)
    return Signal(values=values)


def saturation(rng: Rng, scene: Scene) -> Draft | None:
    """An amplifier that runs into its supply, more or less softly; the size is RMS over limit."""
    number = _pick_actuator(rng, scene)
    if number is None:
        return None
    site, rms, knee = scene.network.drives[number].name, scene.drives[number].rms(), rng.uniform(5.0, 16.0)

    def build(size: float) -> Made:
        limit = rms / size
        return _pointwise(site, lambda u: u / (1 + np.abs(u / limit) ** knee) ** (1 / knee), {"limit": limit})

    return Draft("saturation", "soft amplifier", site, build, (0.6, 0.3, 1.3))


def dead_zone(rng: Rng, scene: Scene) -> Draft | None:
    """A valve's overlap with rounded edges; the size is half its width over the RMS."""
    number = _pick_actuator(rng, scene)
    if number is None:
        return None
    site, rms, rounding = scene.network.drives[number].name, scene.drives[number].rms(), rng.uniform(0.02, 0.08)

    def build(size: float) -> Made:
        half = size * rms

        def overlap(u: Matrix) -> Matrix:
            above, below = u - half, u + half
            soft = (rounding * half) ** 2
            opened: Matrix = 0.5 * (above + np.sqrt(above**2 + soft) + below - np.sqrt(below**2 + soft))
            return opened

        return _pointwise(site, overlap, {"width": half})

    return Draft("dead_zone", "rounded overlap", site, build, (0.1, 0.01, 0.7))


@laws.compiled
def follow(values: Matrix, most: float) -> Matrix:
    """Follow values by no more than `most` from one to the next."""
    followed = np.empty_like(values)
    now = values[0]
    for number in range(len(values)):
        now += min(max(values[number] - now, -most), most)
        followed[number] = now
    return followed


def rate_limit(rng: Rng, scene: Scene) -> Draft | None:
    """A valve spool that moves no faster than it can; the size is the RMS rate over the limit."""
    number = _pick_actuator(rng, scene)
    # A held command jumps at each sample: what follows it at a rate is as much a lag.
    if number is None or scene.hold == "zoh":
        return None
    site, half_step_s = scene.network.drives[number].name, 0.5 * scene.grid.step_s
    rate = float(np.sqrt(np.mean(np.diff(scene.drives[number].values) ** 2))) / half_step_s

    def build(size: float) -> Made:
        limit = rate / size
        return _pointwise(site, lambda u: follow(u, limit * half_step_s), {"rate": limit})

    return Draft("rate_limit", "spool at its speed", site, build, (0.6, 0.35, 1.6))


def harmonics(rng: Rng, scene: Scene) -> Draft | None:
    """An electromagnet's square law beside its line, and a cubic that grows."""
    number = _pick_actuator(rng, scene)
    if number is None:
        return None
    site, rms = scene.network.drives[number].name, scene.drives[number].rms()
    angle = rng.uniform(0.0, 0.45 * np.pi)
    second, third = np.cos(angle) * float(rng.choice([-1, 1])), 0.4 * np.sin(angle)

    def build(size: float) -> Made:
        told = {"second": size * second / rms, "third": size * third / rms**2}
        return _pointwise(site, lambda u: u + told["second"] * u**2 + told["third"] * u**3, told)

    return Draft("harmonics", "square and cube of the command", site, build, (0.05, 0.002, 0.4))


def input_ripple(rng: Rng, scene: Scene) -> Draft | None:
    """A motor's cogging: periodic in the position of the body that the input moves, whatever it commands.

    Where a joint has the same ends, the ripple would be the joint's as well.
    """
    network = scene.network
    joined = network.joined()
    alone = [
        row
        for row, drive in enumerate(network.drives)
        if drive.where == "body" and frozenset((GROUND, drive.at)) not in joined
    ]
    number = pick(rng, tuple(alone))
    if number is None:
        return None
    drive = network.drives[number]
    first, second = GROUND, drive.at
    way, _ = scene.travel(first, second)
    period, phase, rms = rng.uniform(0.6, 2.2) * way, rng.uniform(-np.pi, np.pi), scene.drives[number].rms()

    def build(size: float) -> Made:
        amplitude = size * rms
        element = Element(code=laws.COGGING, first=first, second=second, numbers=(amplitude, period, phase))
        told = {"amplitude": amplitude, "period": period, "phase": phase}
        return Made(Addition(elements=(element,)), told)

    direction = network.direction(first, second)
    return Draft("ripple", "motor's cogging", drive.name, build, (0.1, 0.003, 0.6), direction=direction)


def input_gain_error(rng: Rng, scene: Scene) -> Draft:
    """A wrong calibration; what acts is `gain` times what the log says."""
    number = int(rng.integers(len(scene.network.drives)))
    site, sign = scene.network.drives[number].name, float(rng.choice([-1, 1]))

    def build(size: float) -> Made:
        gain = max(1 + sign * size, 0.2)
        return _pointwise(site, lambda u: gain * u, {"gain": gain})

    return Draft("gain_error", "wrong sensitivity", site, build, (0.15, 0.01, 0.7))


def input_anti_alias(rng: Rng, scene: Scene) -> Draft | None:
    """A filter in the channel of an input that the other channels don't have."""
    if scene.hold == "zoh":
        return None  # the log holds the command itself
    number = int(rng.integers(len(scene.network.drives)))
    site = scene.network.drives[number].name
    order, family = int(rng.integers(4, 9)), str(rng.choice(["Butterworth", "Bessel", "Chebyshev"]))

    def build(size: float) -> Made:
        corner_hz = low_pass_corner_hz(scene, size)
        sections = low_pass(order, family, corner_hz, 2 / scene.grid.step_s)
        told = {"corner_hz": corner_hz, "order": float(order)}
        recorders = {site: lambda signal: Signal(values=sosfilt(sections, signal.values))}
        return Made(Addition(recorders=recorders), told)

    return Draft("anti_alias", f"{family}, only in this channel", site, build, (0.5, 0.1, 8.0))


def low_pass_corner_hz(scene: Scene, size: float) -> float:
    """Corner of a filter by size: the band's end over size, so that a larger one takes more away."""
    return min(scene.band.high_hz / size, 2 * scene.grid.rate_hz)


def low_pass(order: int, family: str, corner_hz: float, rate_hz: float) -> Matrix:
    """Second-order sections of a low-pass."""
    sections: Matrix
    if family == "Bessel":
        sections = bessel(order, corner_hz, fs=rate_hz, output="sos", norm="mag")
    elif family == "Chebyshev":
        sections = cheby1(order, 0.5, corner_hz, fs=rate_hz, output="sos")
    else:
        sections = butter(order, corner_hz, fs=rate_hz, output="sos")
    return sections
