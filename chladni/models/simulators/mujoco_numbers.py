"""Names and numbers of a MuJoCo model: where its arrays keep what may be tuned."""

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter
from chladni.models.effects.wording import nearest
from chladni.signals.errors import ModelError

#: Of a number: how far down, and one over it how far up, it usually goes.
_USUAL = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class _Number:
    """Where MuJoCo keeps a number that may be tuned."""

    array: str
    kind: str
    # Units where the joint turns, and where it slides.
    units: tuple[str, str]
    of_dof: bool = False


_NUMBERS = {
    "damping": _Number(array="dof_damping", kind="joint", units=("N m s/rad", "N s/m"), of_dof=True),
    "armature": _Number(array="dof_armature", kind="joint", units=("kg m^2", "kg"), of_dof=True),
    "frictionloss": _Number(array="dof_frictionloss", kind="joint", units=("N m", "N"), of_dof=True),
    "stiffness": _Number(array="jnt_stiffness", kind="joint", units=("N m/rad", "N/m")),
    "mass": _Number(array="body_mass", kind="body", units=("kg", "kg")),
    "gear": _Number(array="actuator_gear", kind="actuator", units=("1", "1")),
}


def names(model: Any, kind: str) -> list[str]:
    """Names of all bodies, joints, actuators, sensors or keyframes, in MuJoCo's order."""
    places = getattr(model, {"joint": "name_jntadr", "keyframe": "name_keyadr"}.get(kind, f"name_{kind}adr"))
    return [bytes(model.names)[place:].split(b"\0", 1)[0].decode() for place in places]


def index(model: Any, kind: str, name: str) -> int:
    """Place of the named one; `ModelError` that names the nearest when it's missing."""
    known = names(model, kind)
    if name not in known:
        raise ModelError(f"MuJoCo model: no {kind} {name!r}; {nearest(name, [each for each in known if each], kind)}")
    return known.index(name)


def turns(model: Any, joint: int) -> bool:
    """Whether a joint is a hinge; `ModelError` when it's neither that nor a slide."""
    kind = int(model.jnt_type[joint])
    if kind not in (2, 3):
        name = names(model, "joint")[joint]
        raise ModelError(f"MuJoCo model: joint {name!r} has several axes; name a hinge or a slide")
    return kind == 3


def parameter(model: Any, name: str, tolerance: float) -> Parameter:
    """Give ``elbow.damping`` and the like, to be tuned within a relative tolerance; `ModelError` when it can't be."""
    number, _ = _place(model, name)
    value = _number(model, name)
    if not (np.isfinite(tolerance) and tolerance > 0 and value):
        raise ModelError(
            f"MuJoCo model: {name} = {value:g} with a relative tolerance of {tolerance:g} can't be tuned; give both "
            "a value other than zero, or leave it out"
        )
    rotates = number.kind == "joint" and turns(model, index(model, "joint", name.rpartition(".")[0]))
    far = sorted((_USUAL * value, value / _USUAL))
    least = 0.0 if number.array != "actuator_gear" else -inf
    return Parameter(
        name=name,
        value=value,
        unit=number.units[0 if rotates else 1],
        low=far[0],
        high=far[1],
        minimum=least,
        tolerance=tolerance,
    )


def _place(model: Any, name: str) -> tuple[_Number, int]:
    """Which array holds the number, and at which row."""
    owner, _, word = name.rpartition(".")
    if word not in _NUMBERS:
        raise ModelError(f"MuJoCo model: {name!r}: {nearest(word, list(_NUMBERS), 'numbers that may be tuned')}")
    number = _NUMBERS[word]
    place = index(model, number.kind, owner)
    if number.kind == "joint":
        turns(model, place)
    return number, int(model.jnt_dofadr[place]) if number.of_dof else place


def _number(model: Any, name: str) -> float:
    number, place = _place(model, name)
    # A gear has six numbers, of which a joint feels the first; newer versions may give others more than one too.
    return float(np.ravel(getattr(model, number.array)[place])[0])


def set_number(model: Any, name: str, value: float) -> None:
    """Change a model in place; constants that follow from masses are MuJoCo's to compute anew."""
    number, place = _place(model, name)
    if number.array == "body_mass":
        model.body_inertia[place] *= value / float(model.body_mass[place])
    rows = getattr(model, number.array)
    rows.reshape(rows.shape[0], -1)[place, 0] = value
