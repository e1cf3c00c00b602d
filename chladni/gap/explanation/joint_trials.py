"""Trials at joints: friction, stiffness, damping, ripple, along the recovered displacement and velocity."""

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from chladni.gap.explanation.bristles import bristles_along
from chladni.gap.explanation.trial import Force, Numbers, Shape, Spectrum, Trial, logarithms, numbers
from chladni.gap.location.recovered import Recovered
from chladni.models.core.port import Port
from chladni.models.core.port_law import LawFunction, PortLaw
from chladni.models.drives.known_motion import force_along_motion
from chladni.models.effects.hysteresis import bouc_wen, creeping

Matrix = NDArray[np.float64]
#: Most steps between two samples along a recovered motion.
_STEPS = 16
#: Yields over the way's RMS below which there's no loop to be seen, without and with creep.
_LEAST_YIELD, _LEAST_CREEPING = 0.05, 0.01


def joint_trials(motion: Recovered, port: Port) -> Iterator[Trial]:
    """Give every effect of the catalogue that acts at a joint, on grids of what enters it nonlinearly."""
    yield from _friction(motion)
    yield _hysteresis(motion)
    yield _creeping(motion)
    yield from _polynomials(motion)
    if port.stiffness > 0:
        yield _polynomial(motion, "softening_stiffness", motion.displacement**3, "cubic", sign=-1.0)
        yield _yielding(motion, port)
        yield _backlash(motion, port)
        yield from _varying(motion, port)
    yield from _stops(motion)
    yield from ripples(motion, motion.displacement)


def _friction(motion: Recovered) -> Iterator[Trial]:
    s, speed, reach = motion.velocity, _rms(motion.velocity), _rms(motion.displacement)

    def sliding(shape: Shape) -> Force:
        return Force.of(motion.spectrum(np.tanh(s / numbers(shape)[0])))

    def stribeck(shape: Shape) -> Force:
        creep, at = numbers(shape)
        unit = np.tanh(s / creep)
        return Force.of(motion.spectrum(unit), motion.spectrum(unit * np.exp(-((s / at) ** 2))))

    def bristles(shape: Shape) -> Force:
        return Force.of(motion.spectrum(bristles_along(s, motion.lines.sample_rate_hz, numbers(shape)[0])))

    creeps = (0.003 * speed, 0.03 * speed, 0.15 * speed)
    yield Trial(
        effect="coulomb_friction", site=motion.site, variant="regularised", build=sliding, grid=logarithms(creeps),
        values=lambda shape, a: _positive(a, force=a[0], creep_speed=numbers(shape)[0]), parameters=2,
    )  # fmt: skip
    yield Trial(
        effect="coulomb_friction", site=motion.site, variant="bristle", build=bristles,
        grid=logarithms((0.003 * reach, 0.02 * reach, 0.1 * reach)),
        values=lambda shape, a: _positive(a, force=a[0], presliding=numbers(shape)[0]), parameters=2,
    )  # fmt: skip
    yield Trial(
        effect="stribeck_friction", site=motion.site, variant="regularised", build=stribeck,
        grid=logarithms(creeps[:2], (0.05 * speed, 0.15 * speed, 0.4 * speed, 1.0 * speed)),
        values=_stribeck, parameters=4,
    )  # fmt: skip


def _hysteresis(motion: Recovered) -> Trial:
    reach = _rms(motion.displacement)

    def build(shape: Shape) -> Force:
        bend, power = _bouc_wen(shape)
        return Force.of(_along(bouc_wen, (1.0, bend, power), bend, motion))

    def values(shape: Shape, a: Matrix) -> Numbers | None:
        bend, power = _bouc_wen(shape)
        return _positive(a, force=a[0], shape=power, **{"yield": bend})

    def _bouc_wen(shape: Shape) -> tuple[float, float]:
        bend, power = numbers(shape)
        return max(bend, _LEAST_YIELD * reach), max(power, 1.0)

    return Trial(
        effect="hysteresis", site=motion.site,
        build=build,
        grid=logarithms((0.1 * reach, 0.3 * reach, 0.7 * reach, 1.5 * reach), (1.0, 2.0)),
        values=values, parameters=3,
    )  # fmt: skip


def _creeping(motion: Recovered) -> Trial:
    """Hysteresis behind a dashpot: loops over velocity, as those of fluid dampers and rubber."""
    reach, speed, fastest = _rms(motion.displacement), _rms(motion.velocity), float(np.max(np.abs(motion.velocity)))

    def build(shape: Shape) -> Force:
        bend, slip = max(numbers(shape)[0], _LEAST_CREEPING * reach), numbers(shape)[1]
        return Force.of(_along(creeping, (1.0, bend, 1.0, slip, 0.5), bend, motion))

    def values(shape: Shape, a: Matrix) -> Numbers | None:
        bend, slip = max(numbers(shape)[0], _LEAST_CREEPING * reach), numbers(shape)[1]
        # An element that the motion never makes yield is a spring and a dashpot in series.
        return _positive(a, force=a[0], slip_speed=slip, **{"yield": bend}) if slip < fastest else None

    return Trial(
        effect="hysteresis", site=motion.site, variant="creeping", build=build,
        grid=logarithms((0.02 * reach, 0.06 * reach, 0.2 * reach), (0.1 * speed, 0.3 * speed)),
        values=values, parameters=4,
    )  # fmt: skip


def _polynomial(motion: Recovered, effect: str, signal: Matrix, name: str, *, sign: float = 1.0) -> Trial:
    spectrum = motion.spectrum(signal)
    return Trial(
        effect=effect, site=motion.site, build=lambda _: Force.of(spectrum),
        values=lambda _, a: {name: float(a[0])} if sign * a[0] > 0 else None, parameters=1,
    )  # fmt: skip


def _polynomials(motion: Recovered) -> Iterator[Trial]:
    d, s = motion.displacement, motion.velocity
    yield _polynomial(motion, "quadratic_damping", s * np.abs(s), "coefficient")
    yield _polynomial(motion, "hardening_stiffness", d**3, "cubic")
    yield Trial(
        effect="hardening_stiffness", site=motion.site, variant="progressive",
        build=lambda _: Force.of(motion.spectrum(d**3), motion.spectrum(d**5)),
        values=lambda _, a: _positive(a, cubic=a[0], range=np.sqrt(a[0] / a[1])) if min(a) > 0 else None,
        parameters=2,
    )  # fmt: skip
    yield Trial(
        effect="hardening_stiffness", site=motion.site, variant="asymmetric",
        build=lambda _: Force.of(motion.spectrum(d**3), motion.spectrum(d**2)),
        values=lambda _, a: _positive(a, cubic=a[0], quadratic=a[1]), parameters=2,
    )  # fmt: skip


def _yielding(motion: Recovered, port: Port) -> Trial:
    d, reach = motion.displacement, _rms(motion.displacement)

    def build(shape: Shape) -> Force:
        return Force.of(motion.spectrum(-d * (1.0 - 1.0 / np.sqrt(1.0 + (d / numbers(shape)[0]) ** 2))))

    def values(shape: Shape, a: Matrix) -> Numbers | None:
        lost = min(float(a[0]) / port.stiffness, 1.0)
        return _positive(a, cubic=-0.5 * lost * port.stiffness / numbers(shape)[0] ** 2, lost=lost)

    # From a spring that yields at once to one that only begins to.
    return Trial(
        effect="softening_stiffness", site=motion.site, variant="yielding", build=build,
        grid=logarithms((reach * np.geomspace(0.01, 10.0, 7)).tolist()), values=values, parameters=2,
    )  # fmt: skip


def _backlash(motion: Recovered, port: Port) -> Trial:
    d, reach = motion.displacement, _rms(motion.displacement)

    def build(shape: Shape) -> Force:
        half = numbers(shape)[0] / 2
        return Force.known(motion.spectrum(-port.stiffness * np.clip(d, -half, half)))

    # From hardly any play to one that the motion barely crosses.
    gaps = 2 * reach * np.geomspace(5e-4, 2.0, 24)
    return Trial(
        effect="backlash", site=motion.site, build=build, grid=logarithms(gaps.tolist()),
        values=lambda shape, _: {"gap": numbers(shape)[0]}, parameters=1,
    )  # fmt: skip


def _varying(motion: Recovered, port: Port) -> Iterator[Trial]:
    d, t = motion.displacement, motion.time_s
    length = float(t[-1])

    def change(shape: Shape, amplitudes: Matrix) -> Numbers | None:
        relative = float(amplitudes[0]) / port.stiffness
        return {"relative_change": relative, "time": numbers(shape)[0]} if relative > -0.95 else None

    yield Trial(
        effect="varying_stiffness", site=motion.site, variant="drift",
        build=lambda shape: Force.of(motion.spectrum(d * np.minimum(t / numbers(shape)[0], 1.0))),
        grid=logarithms((0.4 * length, length)), values=change, parameters=2,
    )  # fmt: skip
    # From a jump to a change that takes half of the log.
    rises = (0.01 * length, 0.15 * length, 0.5 * length)

    yield Trial(
        effect="varying_stiffness", site=motion.site, variant="step",
        build=lambda shape: Force.of(motion.spectrum(d * share_risen(t, *numbers(shape)))),
        grid=logarithms(np.linspace(0.1 * length, 0.9 * length, 9).tolist(), rises),
        values=lambda shape, a: _with_rise(change(shape, a), shape), parameters=3,
    )  # fmt: skip


def share_risen(t: Matrix, time: float, rise: float) -> Matrix:
    """Give ``[sample]`` which share of a step's change is there at times t, as in `varying_stiffness`."""
    u = np.clip((t - time) / rise + 0.5, 0.0, 1.0)
    return np.asarray(u**3 * (10.0 + u * (6.0 * u - 15.0)), dtype=np.float64)


def _with_rise(values: Numbers | None, shape: Shape) -> Numbers | None:
    return None if values is None else {**values, "rise": numbers(shape)[1]}


def _stops(motion: Recovered) -> Iterator[Trial]:
    for side in (1.0, -1.0):
        yield _stop(motion, side, "spring", 1.0)
        yield _stop(motion, side, "hertz_damper", 1.5)


def _stop(motion: Recovered, side: float, variant: str, power: float) -> Trial:
    d, s = side * motion.displacement, side * motion.velocity
    # How much of the way to the furthest point is free, so that a search can't leave the motion.
    low, high = float(np.quantile(d, 0.3)), float(np.max(d))
    depth = 0.1 * (high - low)

    def clearance(shape: Shape) -> float:
        return high - (high - low) * min(numbers(shape)[0], 1.0)

    def build(shape: Shape) -> Force:
        pressed = side * np.maximum(d - clearance(shape), 0.0) ** power
        return Force.of(*(motion.spectrum(one) for one in ([pressed] if power == 1.0 else [pressed, pressed * s])))

    def values(shape: Shape, a: Matrix) -> Numbers | None:
        if power == 1.0:
            return _positive(a, stiffness=a[0], clearance=clearance(shape), side=side)
        stiffness, loss = a[0] * np.sqrt(depth), max(a[1] / a[0], 0.0) if a[0] > 0 else 0.0
        return _positive(a, stiffness=stiffness, clearance=clearance(shape), side=side, depth=depth, dissipation=loss)

    return Trial(
        effect="one_sided_stop", site=motion.site, variant=variant, build=build,
        grid=logarithms((0.08, 0.2, 0.35, 0.5, 0.7, 0.9)), values=values, parameters=2 if power == 1.0 else 3,
    )  # fmt: skip


def ripples(motion: Recovered, position: Matrix) -> Iterator[Trial]:
    """Give the trials of a force periodic in a position ``[sample]``, with one harmonic and with two."""
    span = float(np.quantile(position, 0.98) - np.quantile(position, 0.02)) or 1.0

    def build(shape: Shape, *, orders: tuple[float, ...]) -> Force:
        angle = 2 * np.pi * position / numbers(shape)[0]
        return Force.of(*(motion.spectrum(wave(order * angle)) for order in orders for wave in (np.sin, np.cos)))

    def first(shape: Shape, a: Matrix) -> Numbers:
        phase = float(np.arctan2(a[1], a[0]))
        return {"amplitude": float(np.hypot(a[0], a[1])), "period": numbers(shape)[0], "phase": phase}

    def both(shape: Shape, a: Matrix) -> Numbers | None:
        found = first(shape, a)
        # Turned by twice the phase, since the law counts its second harmonic from where the first begins.
        second = complex(a[2], a[3]) * np.exp(-2j * found["phase"])
        if abs(second) >= found["amplitude"]:
            return None
        share = second / found["amplitude"]
        return {**found, "second_sine": float(share.real), "second_cosine": float(share.imag)}

    grid = logarithms(np.geomspace(0.03 * span, span, 32).tolist())
    yield Trial(
        effect="ripple", site=motion.site, variant="sine", build=partial(build, orders=(1.0,)), grid=grid,
        values=first, parameters=3,
    )  # fmt: skip
    yield Trial(
        effect="ripple", site=motion.site, variant="harmonics", build=partial(build, orders=(1.0, 2.0)), grid=grid,
        values=both, parameters=5,
    )  # fmt: skip


def _positive(amplitudes: Matrix, **values: float) -> Numbers | None:
    return {name: float(value) for name, value in values.items()} if amplitudes[0] > 0 else None


def _stribeck(shape: Shape, amplitudes: Matrix) -> Numbers | None:
    # Less friction at rest than in motion is no Stribeck curve.
    if amplitudes[0] <= 0 or amplitudes[1] <= 0:
        return None
    creep, speed = numbers(shape)
    coulomb, more = float(amplitudes[0]), float(amplitudes[1])
    return {"coulomb": coulomb, "static": coulomb + more, "speed": speed, "creep_speed": creep}


def _along(law: LawFunction, parameters: tuple[float, ...], bend: float, motion: Recovered) -> Spectrum:
    """Spectrum of a law with a state that turns round within a way of about `bend`."""
    port_law = PortLaw(port=0, function=law, parameters=parameters, state=(0.0,))
    # Steps of more than 2.8 bends run away; where the motion is that fast the law slides anyway.
    furthest = float(np.max(np.abs(motion.velocity))) / motion.lines.sample_rate_hz
    steps = int(np.clip(np.ceil(0.7 * furthest / bend), 4, _STEPS))
    return motion.spectrum(
        force_along_motion(port_law, motion.displacement, motion.velocity, motion.time_s, substeps=steps)
    )


def _rms(signal: Matrix) -> float:
    return float(np.sqrt(np.mean(signal**2))) or 1.0
