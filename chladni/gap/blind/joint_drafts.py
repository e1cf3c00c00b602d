"""Drafts of effects at joints: laws other than the catalogue's, sized by how the joint moves."""

from collections.abc import Callable, Mapping

from chladni.gap.blind.draft import Draft, Scene
from chladni.gap.blind.plan import Hidden

Drafter = Callable[[Scene, str], Draft]


def _draft(effect: str, site: str, law: str, numbers: Callable[[float], dict[str, float]], *, least: float = 1e-3,
           most: float = 30.0) -> Draft:  # fmt: skip
    def hidden(size: float) -> Hidden:
        return Hidden(effect=effect, site=site, law=law, numbers=numbers(size))

    return Draft(hidden=hidden, least=least, most=most)


def coulomb(scene: Scene, site: str) -> Draft:
    """Dahl's law, or bristles without Stribeck's excess."""
    force, bend = scene.force_at(site), scene.moving[f"{site}.d"] * scene.about(0.005, 0.06)
    if scene.one_of("dahl", "lugre") == "dahl":
        exponent = scene.between(0.7, 1.5)
        return _draft("coulomb_friction", site, "dahl", lambda size: {
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

    return _draft(effect, site, "lugre", numbers)


def hysteresis(scene: Scene, site: str) -> Draft:
    """Bouc-Wen of another shape, or sliders that give way one after the other."""
    force, bend = scene.force_at(site), scene.moving[f"{site}.d"] * scene.about(0.3, 1.2)
    if scene.one_of("bouc_wen", "masing") == "masing":
        return _draft("hysteresis", site, "masing", lambda size: {"force": 0.2 * size * force, "yield": bend})
    beta, exponent = scene.between(0.4, 0.8), scene.between(1.2, 4.0)
    return _draft("hysteresis", site, "bouc_wen", lambda size: {
        "force": 0.2 * size * force, "yield": bend, "beta": beta, "gamma": 1 - beta,
        "exponent": exponent})  # fmt: skip


def quadratic(scene: Scene, site: str) -> Draft:
    """Turbulent but near rest."""
    force, speed = scene.force_at(site), scene.moving[f"{site}.s"]
    laminar = speed * scene.about(0.02, 0.15)
    return _draft("quadratic_damping", site, "quadratic", lambda size: {
        "coefficient": 0.1 * size * force / speed**2, "laminar_speed": laminar}, most=100.0)  # fmt: skip


def hardening(scene: Scene, site: str) -> Draft:
    """Cubic with a fifth power, or a progressive buffer."""
    k, d = scene.stiffness(site), scene.moving[f"{site}.d"]
    if scene.one_of("cubic_quintic", "rubber") == "rubber":
        return _draft("hardening_stiffness", site, "rubber", lambda size: {
            "stiffness": k, "length": 3.0 * d / size**0.5}, most=6.0)  # fmt: skip
    fifth = scene.about(0.005, 0.05)
    return _draft("hardening_stiffness", site, "cubic_quintic", lambda size: {
        "cubic": 0.03 * size * k / d**2, "quintic": 0.03 * size * k * fifth / d**4})  # fmt: skip


def softening(scene: Scene, site: str) -> Draft:
    """A spring that yields like an arc tangent, or like a sine as far as it goes."""
    k, d = scene.stiffness(site), scene.moving[f"{site}.d"]
    law, reach = scene.one_of("arctangent", "sine_spring"), scene.between(4.0, 5.0)
    return _draft("softening_stiffness", site, law, lambda size: {
        "stiffness": k, "length": reach * d / size**0.5}, most=6.0)  # fmt: skip


def backlash(scene: Scene, site: str) -> Draft:
    """Play with rounded corners, with and without the damper inside."""
    k, d = scene.stiffness(site), scene.moving[f"{site}.d"]
    c = scene.numbers[f"{site}.damping"] if scene.rng.random() < 0.5 else 0.0
    corner = scene.between(0.03, 0.1)
    return _draft("backlash", site, "soft_play", lambda size: {
        "stiffness": k, "half_gap": 0.3 * size * d, "rounding": 0.3 * size * d * corner, "damping": c},
        most=4.0)  # fmt: skip


def stop(scene: Scene, site: str) -> Draft:
    """Contact of rough or round bodies, or a spring, with Hunt and Crossley's damping."""
    d, force = scene.moving[f"{site}.d"], scene.force_at(site)
    clearance, exponent = scene.between(0.3, 1.6) * d, scene.between(1.2, 1.8) if scene.rng.random() < 0.7 else 1.0
    side, loss = scene.sign(), scene.between(0.05, 0.5) / scene.moving[f"{site}.s"]
    return _draft("one_sided_stop", site, "contact", lambda size: {
        "stiffness": size * force / d**exponent, "clearance": clearance, "side": side, "dissipation": loss,
        "exponent": exponent}, most=100.0)  # fmt: skip


def varying(scene: Scene, site: str) -> Draft:
    """Smooth drift, ramp, or a step that takes a while."""
    k, sign, middle = scene.stiffness(site), scene.sign(), scene.between(0.3, 0.7) * scene.seconds
    law = scene.one_of("smooth_change", "smooth_change", "ramp_change")
    width = scene.seconds * (scene.between(0.05, 0.15) if scene.rng.random() < 0.5 else 0.002)
    place = {"middle": middle, "width": width} if law == "smooth_change" else {
        "start": 0.3 * middle, "end": middle + 0.2 * scene.seconds}  # fmt: skip
    return _draft("varying_stiffness", site, law, lambda size: {"change": 0.1 * sign * size * k, **place}, most=6.0)


def joint_ripple(scene: Scene, site: str) -> Draft:
    """Cogging with a second and a third harmonic."""
    period, force = scene.moving[f"{site}.d"] * scene.about(0.7, 2.5), scene.force_at(site)
    shape = {"period": period, **scene.ripple_shape()}
    return _draft("ripple", site, "ripple", lambda size: {"amplitude": 0.1 * size * force, **shape})


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
