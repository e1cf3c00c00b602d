"""Drafts of effects of actuators and sensors."""

from collections.abc import Callable, Mapping
from math import pi

from chladni.gap.blind.body_drafts import tone_at_output
from chladni.gap.blind.draft import Draft, Scene
from chladni.gap.blind.plan import Hidden

Drafter = Callable[[Scene, str], Draft]


def _draft(effect: str, site: str, law: str, numbers: Callable[[float], dict[str, float]], *, least: float = 1e-3,
           most: float = 30.0, source: str = "") -> Draft:  # fmt: skip
    def hidden(size: float) -> Hidden:
        return Hidden(effect=effect, site=site, law=law, numbers=numbers(size), source=source)

    return Draft(hidden=hidden, least=least, most=most)


def delay(scene: Scene, site: str) -> Draft:
    """Dead time of no whole number of samples, sometimes smeared."""
    law = scene.one_of("dead_time", "smeared")
    spread = {"spread": scene.between(0.05, 0.15)} if law == "smeared" else {}
    return _draft("delay", site, law, lambda size: {"delay": 0.317 * size * scene.interval, **spread}, least=0.4,
                  most=80.0)  # fmt: skip


def lag(scene: Scene, site: str) -> Draft:
    """An actuator of second order, springy or sluggish: near 0.7 it would be a dead time but for terms of s^4."""
    slow = 1.0 / (2 * pi * 8.0 * scene.bench.modes_hz[-1])
    ratio = scene.between(0.4, 0.55) if scene.rng.random() < 0.4 else scene.between(0.9, 1.4)
    return _draft("lag", site, "second_order", lambda size: {
        "time_constant": size * slow, "damping_ratio": ratio}, least=0.05, most=60.0)  # fmt: skip


def saturation(scene: Scene, site: str) -> Draft:
    """Anything between a hard stop and a hyperbolic tangent."""
    level, law = scene.moving[f"{site}.u"], scene.one_of("hard_limit", "soft_limit", "hyperbolic_limit")
    extra = {"sharpness": scene.between(3.0, 10.0)} if law == "soft_limit" else {}
    return _draft("saturation", site, law, lambda size: {"limit": 4.0 * level / size, **extra}, least=0.2, most=16.0)


def dead_zone(scene: Scene, site: str) -> Draft:
    """An overlap with rounded edges."""
    level, corner = scene.moving[f"{site}.u"], scene.between(0.02, 0.08)
    return _draft("dead_zone", site, "overlap", lambda size: {
        "width": 0.05 * size * level, "rounding": 0.05 * size * level * corner}, most=20.0)  # fmt: skip


def rate_limit(scene: Scene, site: str) -> Draft:
    """A valve that moves no faster, and softly at its goal."""
    swift = scene.moving[f"{site}.u"] * 2 * pi * scene.bench.modes_hz[-1]
    return _draft("rate_limit", site, "slew", lambda size: {
        "rate": 4.0 * swift / size, "tracking_time": 0.05 * scene.interval}, least=0.1, most=60.0)  # fmt: skip


def input_ripple(scene: Scene, site: str) -> Draft:
    """A motor's cogging over the position at which it pushes."""
    period, level = scene.moving[f"{site}.x"] * scene.about(0.7, 2.5), scene.moving[f"{site}.u"]
    shape = {"period": period, **scene.ripple_shape()}
    return _draft("ripple", site, "ripple", lambda size: {"amplitude": 0.1 * size * level, **shape})


def input_gain(scene: Scene, site: str) -> Draft:
    """A wrong calibration of the force, by more than masses and springs together are doubted."""
    sign = scene.sign()
    if scene.rng.random() < 0.15:
        return _draft("gain_error", site, "factor", lambda size: {"gain": -1.0 - 0.1 * size}, most=1.0)
    return _draft("gain_error", site, "factor", lambda size: {"gain": 1.0 + sign * 0.25 * size}, least=0.9, most=2.4)


def output_gain(scene: Scene, site: str) -> Draft:
    """A wrong sensitivity; sometimes the sign."""
    sign = scene.sign()
    if scene.rng.random() < 0.12:
        return _draft("gain_error", site, "factor", lambda size: {"gain": -1.0 - 0.1 * size}, most=1.0)
    return _draft("gain_error", site, "factor", lambda size: {"gain": 1.0 + sign * 0.1 * size}, least=0.05, most=6.0)


def cross_axis(scene: Scene, site: str) -> Draft:
    """A share of another sensor of the same quantity."""
    plan = scene.bench.plan
    own = next(one for one in plan.outputs if one.name == site)
    others = [one.name for one in plan.outputs if one.name != site and one.measures == own.measures]
    source, sign = scene.one_of(*others), scene.sign()
    share = scene.moving[site] / scene.moving[source]
    return _draft("cross_axis", site, "share", lambda size: {"coefficient": 0.1 * sign * size * share}, source=source)


def mounting_resonance(scene: Scene, site: str) -> Draft:
    """A mount whose damper gives way, too: at its frequency the damping is nearly as without."""
    highest, ratio, relaxation = scene.bench.modes_hz[-1], scene.about(0.01, 0.15), scene.between(0.1, 0.5)
    most = min(8.0, 8.0 * scene.bench.modes_hz[-1] / scene.bench.modes_hz[0])
    return _draft("mounting_resonance", site, "mount", lambda size: {
        "frequency": 8.0 * highest / size, "damping_ratio": ratio, "relaxation": relaxation},
        least=0.5, most=most)  # fmt: skip


def ac_coupling(scene: Scene, site: str) -> Draft:
    """Three coupling stages: two alike, and a slow one."""
    lowest, ratio, slow = scene.bench.modes_hz[0], scene.between(0.6, 1.2), scene.between(0.05, 0.25)
    return _draft("ac_coupling", site, "coupling", lambda size: {
        "corner": 0.05 * size * lowest, "damping_ratio": ratio, "slow": slow}, least=0.02, most=16.0)  # fmt: skip


def time_offset(scene: Scene, site: str) -> Draft:
    """A clock that is early or late by a part of a sample, or by many."""
    sign = scene.sign()
    step = sign * scene.interval / 32
    # Whole steps of the integrator: the truth then says what was done, to the last digit.
    return _draft("time_offset", site, "shift", lambda size: {"offset": max(round(4 * size), 1) * step},
                  least=0.25, most=400.0)  # fmt: skip


def clipping(scene: Scene, site: str) -> Draft:
    """A range that ends, not quite at the same size on both sides, or with a rounded edge."""
    level, uneven = scene.moving[site], scene.between(-0.08, 0.08)
    if scene.rng.random() < 0.3:
        return _draft("clipping", site, "round_clip", lambda size: {
            "limit": 4.0 * level / size, "sharpness": 16.0}, least=0.3, most=12.0)  # fmt: skip
    return _draft("clipping", site, "clip", lambda size: {"limit": 4.0 * level / size, "asymmetry": uneven},
                  least=0.3, most=12.0)  # fmt: skip


def quantization(scene: Scene, site: str) -> Draft:
    """A coarse converter, which rounds or cuts."""
    level, law = scene.moving[site], scene.one_of("floor_steps", "round_steps")
    return _draft("quantization", site, law, lambda size: {"step": 0.05 * size * level}, most=40.0)


INPUT_DRAFTS: Mapping[str, Drafter] = {
    "delay": delay,
    "lag": lag,
    "saturation": saturation,
    "dead_zone": dead_zone,
    "rate_limit": rate_limit,
    "ripple": input_ripple,
    "gain_error": input_gain,
}
OUTPUT_DRAFTS: Mapping[str, Drafter] = {
    "gain_error": output_gain,
    "cross_axis": cross_axis,
    "mounting_resonance": mounting_resonance,
    "ac_coupling": ac_coupling,
    "time_offset": time_offset,
    "clipping": clipping,
    "quantization": quantization,
    "tonal_disturbance": tone_at_output,
}
