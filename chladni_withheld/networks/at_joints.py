"""Effects at joints: friction, springs that bend their line, play, stops, hysteresis, cogging."""

from collections.abc import Callable

import numpy as np

from chladni_withheld.networks import laws
from chladni_withheld.networks.draft import Draft, JointPort, Made, pick_joint
from chladni_withheld.networks.machine import Addition
from chladni_withheld.networks.network import Matrix
from chladni_withheld.networks.scene import Rng, Scene


def _at(
    port: JointPort, word: str, law: str, build: Callable[[float], Made], sizes: tuple[float, float, float],
    acting: tuple[float, float] = (0.0, 1.0),
) -> Draft:  # fmt: skip
    return Draft(word, law, port.name, build, sizes, acting=acting, direction=port.direction)


def _presliding(rng: Rng, scene: Scene, port: JointPort) -> float:
    """Way before sliding: a small part of the motion, and as long as the integrator's steps can follow."""
    return max(rng.uniform(0.04, 0.08) * port.way, 3 * port.speed * scene.grid.step_s)


def coulomb_friction(rng: Rng, scene: Scene) -> Draft:
    """LuGre's bristles without a rise at rest, or Maxwell slip: four sliders that let go one after another."""
    port = pick_joint(rng, scene)
    presliding = _presliding(rng, scene, port)
    slip = rng.random() < 0.4

    def build(size: float) -> Made:
        force = size * port.load
        told = {"force": force, "presliding": presliding}
        if slip:
            yields = presliding * np.array([0.4, 0.8, 1.2, 1.6])
            return Made(_sliders(port, 0.25 * force / yields, yields), told)
        bristles = (force / presliding, force, 0.0, port.speed, 0.1 * force / port.speed)
        return Made(port.element(laws.BRISTLE, *bristles), told)

    law = "Maxwell slip" if slip else "LuGre without Stribeck's rise"
    return _at(port, "coulomb_friction", law, build, (0.08, 0.003, 0.6), (0.25, 0.98))


def stribeck_friction(rng: Rng, scene: Scene) -> Draft:
    """LuGre's bristles, with a Lorentz curve of the speed for Stribeck's rise."""
    port = pick_joint(rng, scene)
    presliding = _presliding(rng, scene, port)
    rise, speed = rng.uniform(0.6, 1.5), rng.uniform(0.15, 0.6) * port.speed

    def build(size: float) -> Made:
        force = size * port.load
        bristles = (force / presliding, force, rise * force, speed, 0.1 * force / port.speed)
        told = {"coulomb": force, "static": (1 + rise) * force, "speed": speed}
        return Made(port.element(laws.BRISTLE, *bristles), told)

    return _at(port, "stribeck_friction", "LuGre, Lorentz curve", build, (0.08, 0.003, 0.5), (0.25, 0.98))


def quadratic_damping(rng: Rng, scene: Scene) -> Draft:
    """An orifice whose flow is laminar at small speeds."""
    port = pick_joint(rng, scene)
    laminar = rng.uniform(0.05, 0.2) * port.speed

    def build(size: float) -> Made:
        coefficient = size * port.load / port.speed**2
        addition = port.element(laws.TURBULENT, coefficient, laminar)
        return Made(addition, {"coefficient": coefficient, "laminar_speed": laminar})

    return _at(port, "quadratic_damping", "orifice, laminar below a speed", build, (0.1, 0.005, 1.5))


def _spring(rng: Rng, scene: Scene, word: str, forms: dict[str, tuple[int, float, float]], largest: float) -> Draft:
    """A spring beside the joint's, of one form: code of its law, and its reach from and to in RMS ways."""
    port = pick_joint(rng, scene, spring=True)
    law = str(rng.choice(list(forms)))
    code, nearest, farthest = forms[law]
    reach = rng.uniform(nearest, farthest) * port.way

    def build(size: float) -> Made:
        stiffness = size * port.stiffness
        addition = port.element(code, stiffness, reach)
        return Made(addition, {"stiffness": stiffness, "reach": reach})

    return _at(port, word, law, build, (min(0.5, 0.5 * largest), 0.01, largest))


def hardening_stiffness(rng: Rng, scene: Scene) -> Draft:
    """Magnets that repel, a bearing near its end, or wires pulled sideways."""
    forms = {
        "repelling magnets": (laws.MAGNETS, 6.0, 9.0),
        "tangent": (laws.TANGENT, 6.0, 9.0),
        "wires pulled sideways": (laws.WIRES, 1.5, 4.0),
    }
    return _spring(rng, scene, "hardening_stiffness", forms, 20.0)


def softening_stiffness(rng: Rng, scene: Scene) -> Draft:
    """An arctangent or a rolling membrane; the joint's own spring stays stronger."""
    forms = {"arctangent": (laws.ARCTANGENT, 1.0, 3.0), "membrane": (laws.MEMBRANE, 1.2, 3.5)}
    return _spring(rng, scene, "softening_stiffness", forms, 0.8)


def geometric(rng: Rng, scene: Scene) -> Draft:
    """A spring at an angle to the motion: its force has even powers too."""
    port = pick_joint(rng, scene, spring=True)
    length, angle = rng.uniform(5.0, 9.0) * port.way, rng.uniform(0.7, 1.2)

    def build(size: float) -> Made:
        stiffness = size * port.stiffness
        addition = port.element(laws.INCLINED, stiffness, length, angle)
        return Made(addition, {"stiffness": stiffness, "length": length, "angle_rad": angle})

    return _at(port, "geometric", "spring at an angle", build, (0.5, 0.02, 20.0))


def backlash(rng: Rng, scene: Scene) -> Draft:
    """Play with rounded contact; the size is the gap over the RMS way."""
    port = pick_joint(rng, scene, spring=True)
    rounding = rng.uniform(0.02, 0.08)

    def build(size: float) -> Made:
        gap = size * port.way
        return Made(port.element(laws.PLAY, port.stiffness, gap, rounding * gap), {"gap": gap})

    return _at(port, "backlash", "play with rounded contact", build, (0.3, 0.02, 2.5), (0.01, 0.7))


def one_sided_stop(rng: Rng, scene: Scene) -> Draft:
    """Hertz's contact with Hunt and Crossley's losses, or a rubber bumper, on either side."""
    port = pick_joint(rng, scene)
    clearance, side = rng.uniform(0.5, 1.6) * port.way, float(rng.choice([-1, 1]))
    hard = rng.random() < 0.6
    losses = rng.uniform(0.05, 0.3) / port.speed

    def build(size: float) -> Made:
        if hard:
            stiffness = size * port.stiffness / np.sqrt(port.way)
            addition = port.element(laws.HERTZ, stiffness, clearance, losses, side)
        else:
            stiffness = size * port.stiffness
            damping = losses * stiffness * port.way
            addition = port.element(laws.BUMPER, stiffness, clearance, damping, side)
        return Made(addition, {"stiffness": stiffness, "clearance": side * clearance})

    law = "Hertz, Hunt and Crossley" if hard else "rubber bumper"
    return _at(port, "one_sided_stop", law, build, (0.8, 0.05, 8.0), (0.02, 0.45))


def hysteresis(rng: Rng, scene: Scene) -> Draft:
    """Iwan's sliders, which yield one after another over the range of the motion (Masing)."""
    port = pick_joint(rng, scene, spring=True)
    yields = np.geomspace(rng.uniform(0.15, 0.3), rng.uniform(1.2, 2.0), laws.SLIDERS) * port.way

    def build(size: float) -> Made:
        stiffness = size * port.stiffness
        stiffnesses = np.full(laws.SLIDERS, stiffness / laws.SLIDERS)
        told = {"stiffness": stiffness, "force": float(stiffnesses @ yields), "yield": float(yields.mean())}
        return Made(_sliders(port, stiffnesses, yields), told)

    return _at(port, "hysteresis", "Iwan's sliders", build, (0.2, 0.02, 1.2), (0.05, 0.7))


def _sliders(port: JointPort, stiffnesses: Matrix, yields: Matrix) -> Addition:
    numbers = np.zeros(2 * laws.SLIDERS)
    numbers[: len(yields)] = stiffnesses
    numbers[laws.SLIDERS : laws.SLIDERS + len(yields)] = yields
    return port.element(laws.SLIDING, *numbers.tolist())


def varying_stiffness(rng: Rng, scene: Scene) -> Draft:
    """A spring that warms up, cracks, or creeps; the size is its relative change by the log's end."""
    port = pick_joint(rng, scene, spring=True)
    form = int(rng.integers(3))
    lasts_s = scene.grid.duration_s
    start_s = (rng.uniform(0.0, 0.3), rng.uniform(0.3, 0.7), rng.uniform(0.0, 0.1))[form] * lasts_s
    length_s = (rng.uniform(0.2, 0.5), 0.01, 0.05)[form] * lasts_s
    sign = float(rng.choice([-1, 1]))
    whole = abs(laws.changing(1.0, lasts_s, 1.0, float(form), start_s, length_s))

    def build(size: float) -> Made:
        part = sign * size / whole * port.stiffness
        addition = port.element(laws.CHANGING, part, float(form), start_s, length_s)
        return Made(addition, {"change": sign * size, "start_s": start_s, "length_s": length_s})

    law = ("warming", "crack", "creep")[form]
    return _at(port, "varying_stiffness", law, build, (0.08, 0.004, 0.5))


def ripple(rng: Rng, scene: Scene) -> Draft:
    """Cogging with a second harmonic, across a joint."""
    port = pick_joint(rng, scene)
    period, phase = rng.uniform(0.6, 2.2) * port.way, rng.uniform(-np.pi, np.pi)

    def build(size: float) -> Made:
        amplitude = size * port.load
        addition = port.element(laws.COGGING, amplitude, period, phase)
        return Made(addition, {"amplitude": amplitude, "period": period, "phase": phase})

    return _at(port, "ripple", "cogging, two harmonics", build, (0.1, 0.005, 0.5))
