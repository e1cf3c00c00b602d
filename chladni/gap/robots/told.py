"""Numbers of words as they're told: gains, places and stiffnesses in place of what columns are linear in."""

import numpy as np

from chladni.gap.robots.term import Term
from chladni.signals.arrays import Real

#: Value, standard deviation and unit by name.
Numbers = dict[str, tuple[float, float, str]]


def _gain_error(_: Term, values: Real, deviations: Real) -> Numbers:
    gain = 1.0 / float(values[0])
    return {"gain": (gain, float(deviations[0]) * gain**2, "1")}


def _controller_gain(_: Term, values: Real, deviations: Real) -> Numbers:
    kp = 1.0 / float(values[0])
    return {
        "kp": (kp, float(deviations[0]) * kp**2, "1"),
        "kd": (
            1.0 + float(values[1]) * kp,
            float(np.hypot(deviations[1] * kp, values[1] * deviations[0] * kp**2)),
            "1",
        ),
    }


def _payload(_: Term, values: Real, deviations: Real) -> Numbers:
    mass = float(values[0])
    found = {"mass": (mass, float(deviations[0]), "kg")}
    for axis, moment, deviation in zip("xyz", values[1:4], deviations[1:4], strict=True):
        # Where the mass is hardly known, so is its place.
        spread = float(np.hypot(deviation, moment * deviations[0] / mass) / abs(mass)) if mass else np.inf
        found[axis] = (float(moment) / mass if mass else 0.0, spread, "m")
    found["inertia"] = (float(values[4]), float(deviations[4]), "kg m^2")
    return found


def _form_alone(_term: Term, _values: Real, _deviations: Real) -> Numbers:
    """All of what it takes is missing: its form is its number."""
    return {}


def _ripple(term: Term, values: Real, deviations: Real) -> Numbers:
    sine, cosine = map(float, values)
    amplitude = float(np.hypot(sine, cosine))
    spread = float(np.hypot(sine * deviations[0], cosine * deviations[1])) / max(amplitude, 1e-12)
    across = float(np.hypot(cosine * deviations[0], sine * deviations[1])) / max(amplitude, 1e-12) ** 2
    return {
        "amplitude": (amplitude, spread, term.numbers[0].unit),
        "phase": (float(np.arctan2(cosine, sine)), across, "rad"),
    }


def _between(term: Term, values: Real, deviations: Real) -> Numbers:
    """What gives between motor and link, and the rotor; a compliance is told as stiffness where it's one."""
    by_name = {one.name: place for place, one in enumerate(term.numbers)}
    told = {
        name: (float(values[place]), float(deviations[place]), term.numbers[place].unit)
        for name, place in by_name.items()
        if name not in ("both", "part")
    }
    first = "gap" if term.word == "backlash" else "compliance"
    if first not in told and term.form is None:
        # The log tells the product with the rotor's inertia.
        both, rotor = (float(values[by_name[name]]) for name in ("both", "inertia"))
        spread = float(deviations[by_name["both"]])
        told[first] = (both / rotor if rotor else 0.0, spread / rotor if rotor else np.inf, _SOFT[term.word])
    value, spread, unit = told.pop("compliance", (0.0, 0.0, ""))
    if value > 0 or first == "compliance":
        stiffness = 1.0 / value if value > 0 else np.inf
        told["stiffness"] = (stiffness, spread * stiffness**2, "N/m" if unit == "m/N" else "N m/rad")
    return dict(sorted(told.items(), reverse=True))


def _spring(term: Term, values: Real, deviations: Real) -> Numbers:
    stiffness, constant = map(float, values)
    rest = -constant / stiffness if stiffness else 0.0
    spread = float(np.hypot(deviations[1], rest * deviations[0]) / abs(stiffness)) if stiffness else np.inf
    unit = "rad" if "rad" in term.numbers[0].unit else "m"
    return {"stiffness": (stiffness, float(deviations[0]), term.numbers[0].unit), "rest": (rest, spread, unit)}


_SOFT = {"backlash": "rad", "joint_elasticity": "rad/(N m)"}
TOLD = {
    "gain_error": _gain_error,
    "controller_gain": _controller_gain,
    "payload": _payload,
    "saturation": _form_alone,
    "dead_zone": _form_alone,
    "rate_limit": _form_alone,
    "ripple": _ripple,
    "joint_elasticity": _between,
    "backlash": _between,
    "joint_spring": _spring,
}
