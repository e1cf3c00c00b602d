"""Drafts of the vocabulary's effects at joints, bodies, inputs, outputs and the ground.

Laws other than the catalogue's, sized by how what they act on moves.
"""

from collections.abc import Mapping
from math import pi

from chladni_withheld.chains.scene import Draft, Drafter, Scene, draft


def coulomb(scene: Scene, site: str) -> Draft:
    """Dahl's law, or bristles without Stribeck's excess."""
    force, bend = scene.force_at(site), scene.moving[f"{site}.d"] * scene.about(0.005, 0.06)
    if scene.one_of("dahl", "lugre") == "dahl":
        exponent = scene.between(0.7, 1.5)
        return draft("coulomb_friction", site, "dahl", lambda size: {
            "force": 0.1 * size * force, "stiffness": 0.1 * size * force / bend, "exponent": exponent})  # fmt: skip
    return _lugre("coulomb_friction", scene, site, force, bend, 1.0)


def stribeck(scene: Scene, site: str) -> Draft:
    """Bristles that hold more at rest than in motion."""
    bend = scene.moving[f"{site}.d"] * scene.about(0.005, 0.06)
    return _lugre("stribeck_friction", scene, site, scene.force_at(site), bend, scene.between(1.4, 2.2))


def _lugre(effect: str, scene: Scene, site: str, force: float, bend: float, excess: float) -> Draft:
    speed, exponent = scene.moving[f"{site}.s"] * scene.about(0.1, 0.4), scene.between(0.8, 2.0)
    # Bristle damping as of a hundredth of the stiffness at the joint's usual pace.
    damped = scene.between(0.0, 0.3) * scene.moving[f"{site}.d"] / scene.moving[f"{site}.s"]

    def numbers(size: float) -> dict[str, float]:
        sliding = 0.1 * size * force
        stiffness = excess * sliding / bend
        return {"sliding": sliding, "static": excess * sliding, "speed": speed, "exponent": exponent,
                "stiffness": stiffness, "damping": damped * bend / scene.moving[f"{site}.d"] * stiffness}  # fmt: skip

    return draft(effect, site, "lugre", numbers)


def hysteresis(scene: Scene, site: str) -> Draft:
    """Bouc-Wen of another shape, or sliders that give way one after the other."""
    force, bend = scene.force_at(site), scene.moving[f"{site}.d"] * scene.about(0.3, 1.2)
    if scene.one_of("bouc_wen", "masing") == "masing":
        return draft("hysteresis", site, "masing", lambda size: {"force": 0.2 * size * force, "yield": bend})
    beta, exponent = scene.between(0.4, 0.8), scene.between(1.2, 4.0)
    return draft("hysteresis", site, "bouc_wen", lambda size: {
        "force": 0.2 * size * force, "yield": bend, "beta": beta, "gamma": 1 - beta,
        "exponent": exponent})  # fmt: skip


def quadratic(scene: Scene, site: str) -> Draft:
    """Turbulent but near rest."""
    force, speed = scene.force_at(site), scene.moving[f"{site}.s"]
    laminar = speed * scene.about(0.02, 0.15)
    return draft("quadratic_damping", site, "quadratic", lambda size: {
        "coefficient": 0.1 * size * force / speed**2, "laminar_speed": laminar}, most=100.0)  # fmt: skip


def hardening(scene: Scene, site: str) -> Draft:
    """Cubic with a fifth power, or a progressive buffer."""
    k, d = scene.stiffness(site), scene.moving[f"{site}.d"]
    if scene.one_of("cubic_quintic", "rubber") == "rubber":
        return draft("hardening_stiffness", site, "rubber", lambda size: {
            "stiffness": k, "length": 3.0 * d / size**0.5}, most=6.0)  # fmt: skip
    fifth = scene.about(0.005, 0.05)
    return draft("hardening_stiffness", site, "cubic_quintic", lambda size: {
        "cubic": 0.03 * size * k / d**2, "quintic": 0.03 * size * k * fifth / d**4})  # fmt: skip


def softening(scene: Scene, site: str) -> Draft:
    """A spring that yields like an arc tangent, or like a sine as far as it goes."""
    k, d = scene.stiffness(site), scene.moving[f"{site}.d"]
    law, reach = scene.one_of("arctangent", "sine_spring"), scene.between(4.0, 5.0)
    return draft("softening_stiffness", site, law, lambda size: {
        "stiffness": k, "length": reach * d / size**0.5}, most=6.0)  # fmt: skip


def backlash(scene: Scene, site: str) -> Draft:
    """Play with rounded corners, with and without the damper inside."""
    k, d = scene.stiffness(site), scene.moving[f"{site}.d"]
    c = scene.numbers[f"{site}.damping"] if scene.rng.random() < 0.5 else 0.0
    corner = scene.between(0.03, 0.1)
    return draft("backlash", site, "soft_play", lambda size: {
        "stiffness": k, "half_gap": 0.3 * size * d, "rounding": 0.3 * size * d * corner, "damping": c},
        most=4.0)  # fmt: skip


def stop(scene: Scene, site: str) -> Draft:
    """Contact of rough or round bodies, or a spring, with Hunt and Crossley's damping."""
    d, force = scene.moving[f"{site}.d"], scene.force_at(site)
    clearance, exponent = scene.between(0.3, 1.6) * d, scene.between(1.2, 1.8) if scene.rng.random() < 0.7 else 1.0
    side, loss = scene.sign(), scene.between(0.05, 0.5) / scene.moving[f"{site}.s"]
    return draft("one_sided_stop", site, "contact", lambda size: {
        "stiffness": size * force / d**exponent, "clearance": clearance, "side": side, "dissipation": loss,
        "exponent": exponent}, most=100.0)  # fmt: skip


def varying(scene: Scene, site: str) -> Draft:
    """Smooth drift, ramp, or a step that takes a while."""
    k, sign, middle = scene.stiffness(site), scene.sign(), scene.between(0.3, 0.7) * scene.seconds
    law = scene.one_of("smooth_change", "smooth_change", "ramp_change")
    width = scene.seconds * (scene.between(0.05, 0.15) if scene.rng.random() < 0.5 else 0.002)
    place = {"middle": middle, "width": width} if law == "smooth_change" else {
        "start": 0.3 * middle, "end": middle + 0.2 * scene.seconds}  # fmt: skip
    return draft("varying_stiffness", site, law, lambda size: {"change": 0.1 * sign * size * k, **place}, most=6.0)


def joint_ripple(scene: Scene, site: str) -> Draft:
    """Cogging with a second and a third harmonic."""
    period, force = scene.moving[f"{site}.d"] * scene.about(0.7, 2.5), scene.force_at(site)
    shape = {"period": period, **scene.ripple_shape()}
    return draft("ripple", site, "ripple", lambda size: {"amplitude": 0.1 * size * force, **shape})


JOINT_DRAFTS: Mapping[str, Drafter] = {
    "coulomb_friction": coulomb,
    "stribeck_friction": stribeck,
    "hysteresis": hysteresis,
    "quadratic_damping": quadratic,
    "hardening_stiffness": hardening,
    "softening_stiffness": softening,
    "backlash": backlash,
    "one_sided_stop": stop,
    "varying_stiffness": varying,
    "ripple": joint_ripple,
}
#: Effects that change a spring, and so need one.
NEED_A_SPRING = frozenset({"hardening_stiffness", "softening_stiffness", "backlash", "varying_stiffness"})


def extra_mode(scene: Scene, site: str) -> Draft:
    """A clamped beam's first modes, or two masses one behind the other, somewhere in the excited band."""
    modes_hz = scene.bench.modes_hz
    highest_hz = min(1.2 * modes_hz[-1], 0.2 * scene.bench.rate_hz)
    frequency, ratio = scene.about(0.6 * modes_hz[0], highest_hz), scene.about(0.004, 0.04)
    law, body = scene.one_of("beam", "appendage"), scene.mass(site)
    above, share = scene.between(1.8, 3.0), scene.between(0.03, 0.2)

    def numbers(size: float) -> dict[str, float]:
        mass = 0.1 * size * body
        second = {"second_mass": share * mass, "second_frequency": above * frequency} if law == "appendage" else {}
        return {"mass": mass, "frequency": frequency, "damping_ratio": ratio, **second}

    return draft("extra_mode", site, law, numbers, most=10.0)


def added_mass(scene: Scene, site: str) -> Draft:
    """A payload, rigid or on a mount well above what is measured; more than the tolerance explains."""
    mass, plan = scene.mass(site), scene.bench.plan
    least = 4.5 * plan.tolerance[plan.inertia_of(site)]
    stiff, ratio = scene.rng.random() < 0.6, scene.between(0.02, 0.1)
    frequency = min(6.0 * scene.bench.modes_hz[-1], 1.5 * scene.bench.rate_hz)
    mount = {"frequency": frequency, "damping_ratio": ratio} if stiff else {}
    return draft("added_mass", site, "stiff_mount" if stiff else "rigid", lambda size: {
        "mass": size * mass, **mount}, least=least, most=3.0)  # fmt: skip


def tone_at_body(scene: Scene, site: str) -> Draft:
    """A force of a motor that runs nearby, whose speed wanders slightly."""
    return _tone(scene, site, max(scene.force_at(joint.name) for joint in scene.bench.plan.joints))


def tone_at_output(scene: Scene, site: str) -> Draft:
    """Hum on a cable."""
    return _tone(scene, site, scene.moving[site])


def _tone(scene: Scene, site: str, level: float) -> Draft:
    modes_hz = scene.bench.modes_hz
    tone = {
        "frequency": scene.about(0.5 * modes_hz[0], min(1.5 * modes_hz[-1], 0.2 * scene.bench.rate_hz)),
        "phase": scene.between(-3.0, 3.0),
        # A random walk of the phase, in rad per square root of a second.
        "wander": scene.about(0.003, 0.05),
        "seed": float(scene.rng.integers(1 << 31)),
    }
    return draft("tonal_disturbance", site, "tone", lambda size: {**tone, "amplitude": 0.1 * size * level})


def base_vibration(scene: Scene, site: str) -> Draft:
    """A floor that shakes in a band which isn't flat."""
    modes_hz = scene.bench.modes_hz
    low = scene.about(0.2, 0.9) * modes_hz[0]
    high = min(scene.between(1.0, 1.5) * modes_hz[-1], 0.25 * scene.bench.rate_hz)
    felt = max(scene.moving[f"{joint.name}.s"] for joint in scene.bench.plan.joints) * 6.3 * modes_hz[0]
    band = {"low": low, "high": max(high, 2 * low), "tilt": scene.between(-1.0, 1.0),
            "seed": float(scene.rng.integers(1 << 31))}  # fmt: skip
    return draft("base_vibration", site, "shaped_noise", lambda size: {**band, "level": 0.1 * size * felt})


BODY_DRAFTS: Mapping[str, Drafter] = {
    "extra_mode": extra_mode,
    "added_mass": added_mass,
    "tonal_disturbance": tone_at_body,
}


def delay(scene: Scene, site: str) -> Draft:
    """Dead time of no whole number of samples, sometimes smeared."""
    law = scene.one_of("dead_time", "smeared")
    spread = {"spread": scene.between(0.05, 0.15)} if law == "smeared" else {}
    return draft("delay", site, law, lambda size: {"delay": 0.317 * size * scene.interval, **spread}, least=0.4,
                  most=80.0)  # fmt: skip


def lag(scene: Scene, site: str) -> Draft:
    """An actuator of second order, springy or sluggish: near 0.7 it would be a dead time but for terms of s^4."""
    slow = 1.0 / (2 * pi * 8.0 * scene.bench.modes_hz[-1])
    ratio = scene.between(0.4, 0.55) if scene.rng.random() < 0.4 else scene.between(0.9, 1.4)
    return draft("lag", site, "second_order", lambda size: {
        "time_constant": size * slow, "damping_ratio": ratio}, least=0.05, most=60.0)  # fmt: skip


def saturation(scene: Scene, site: str) -> Draft:
    """Anything between a hard stop and a hyperbolic tangent."""
    level, law = scene.moving[f"{site}.u"], scene.one_of("hard_limit", "soft_limit", "hyperbolic_limit")
    extra = {"sharpness": scene.between(3.0, 10.0)} if law == "soft_limit" else {}
    return draft("saturation", site, law, lambda size: {"limit": 4.0 * level / size, **extra}, least=0.2, most=16.0)


def dead_zone(scene: Scene, site: str) -> Draft:
    """An overlap with rounded edges."""
    level, corner = scene.moving[f"{site}.u"], scene.between(0.02, 0.08)
    return draft("dead_zone", site, "overlap", lambda size: {
        "width": 0.05 * size * level, "rounding": 0.05 * size * level * corner}, most=20.0)  # fmt: skip


def rate_limit(scene: Scene, site: str) -> Draft:
    """A valve that moves no faster, and softly at its goal."""
    swift = scene.moving[f"{site}.u"] * 2 * pi * scene.bench.modes_hz[-1]
    return draft("rate_limit", site, "slew", lambda size: {
        "rate": 4.0 * swift / size, "tracking_time": 0.05 * scene.interval}, least=0.1, most=60.0)  # fmt: skip


def input_ripple(scene: Scene, site: str) -> Draft:
    """A motor's cogging over the position at which it pushes."""
    period, level = scene.moving[f"{site}.x"] * scene.about(0.7, 2.5), scene.moving[f"{site}.u"]
    shape = {"period": period, **scene.ripple_shape()}
    return draft("ripple", site, "ripple", lambda size: {"amplitude": 0.1 * size * level, **shape})


def input_gain(scene: Scene, site: str) -> Draft:
    """A wrong calibration of the force, by more than masses and springs together are doubted."""
    sign = scene.sign()
    if scene.rng.random() < 0.15:
        return draft("gain_error", site, "factor", lambda size: {"gain": -1.0 - 0.1 * size}, most=1.0)
    return draft("gain_error", site, "factor", lambda size: {"gain": 1.0 + sign * 0.25 * size}, least=0.9, most=2.4)


def output_gain(scene: Scene, site: str) -> Draft:
    """A wrong sensitivity; sometimes the sign."""
    sign = scene.sign()
    if scene.rng.random() < 0.12:
        return draft("gain_error", site, "factor", lambda size: {"gain": -1.0 - 0.1 * size}, most=1.0)
    return draft("gain_error", site, "factor", lambda size: {"gain": 1.0 + sign * 0.1 * size}, least=0.05, most=6.0)


def cross_axis(scene: Scene, site: str) -> Draft:
    """A share of another sensor of the same quantity."""
    plan = scene.bench.plan
    own = next(one for one in plan.outputs if one.name == site)
    others = [one.name for one in plan.outputs if one.name != site and one.measures == own.measures]
    source, sign = scene.one_of(*others), scene.sign()
    share = scene.moving[site] / scene.moving[source]
    return draft("cross_axis", site, "share", lambda size: {"coefficient": 0.1 * sign * size * share}, source=source)


def mounting_resonance(scene: Scene, site: str) -> Draft:
    """A mount whose damper gives way, too: at its frequency the damping is nearly as without."""
    highest, ratio, relaxation = scene.bench.modes_hz[-1], scene.about(0.01, 0.15), scene.between(0.1, 0.5)
    most = min(8.0, 8.0 * scene.bench.modes_hz[-1] / scene.bench.modes_hz[0])
    return draft("mounting_resonance", site, "mount", lambda size: {
        "frequency": 8.0 * highest / size, "damping_ratio": ratio, "relaxation": relaxation},
        least=0.5, most=most)  # fmt: skip


def ac_coupling(scene: Scene, site: str) -> Draft:
    """Three coupling stages: two alike, and a slow one."""
    lowest, ratio, slow = scene.bench.modes_hz[0], scene.between(0.6, 1.2), scene.between(0.05, 0.25)
    return draft("ac_coupling", site, "coupling", lambda size: {
        "corner": 0.05 * size * lowest, "damping_ratio": ratio, "slow": slow}, least=0.02, most=16.0)  # fmt: skip


def time_offset(scene: Scene, site: str) -> Draft:
    """A clock that is early or late by a part of a sample, or by many."""
    sign = scene.sign()
    step = sign * scene.interval / 32
    # Whole steps of the integrator: the truth then says what was done, to the last digit.
    return draft("time_offset", site, "shift", lambda size: {"offset": max(round(4 * size), 1) * step},
                  least=0.25, most=400.0)  # fmt: skip


def clipping(scene: Scene, site: str) -> Draft:
    """A range that ends, not quite at the same size on both sides, or with a rounded edge."""
    level, uneven = scene.moving[site], scene.between(-0.08, 0.08)
    if scene.rng.random() < 0.3:
        return draft("clipping", site, "round_clip", lambda size: {
            "limit": 4.0 * level / size, "sharpness": 16.0}, least=0.3, most=12.0)  # fmt: skip
    return draft("clipping", site, "clip", lambda size: {"limit": 4.0 * level / size, "asymmetry": uneven},
                  least=0.3, most=12.0)  # fmt: skip


def quantization(scene: Scene, site: str) -> Draft:
    """A coarse converter, which rounds or cuts."""
    level, law = scene.moving[site], scene.one_of("floor_steps", "round_steps")
    return draft("quantization", site, law, lambda size: {"step": 0.05 * size * level}, most=40.0)


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
