"""Mechanical elements of masses, springs and dampers."""

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.elements import declare
from chladni.models.elements.element import ElementKind, Transfer, Values
from chladni.models.elements.transfer_function import TransferFunction


def _mass_spring_damper(v: Values) -> TransferFunction:
    return TransferFunction(num=(1,), den=(v["mass"], v["damping"], v["stiffness"]))


def _isolator(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["damping"], v["stiffness"]), den=(v["mass"], v["damping"], v["stiffness"]))


def _inertia(v: Values) -> TransferFunction:
    return TransferFunction(num=(1,), den=(v["inertia"], v["damping"]))


def _shaft(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["damping"], v["stiffness"]), den=(1, 0))


def _spring_damper(v: Values) -> TransferFunction:
    return TransferFunction(num=(1,), den=(v["damping"], v["stiffness"]))


def _spring_lead(v: Values) -> TransferFunction:
    # Spring 1 parallel to the damper in the way, spring 2 from the output to the ground.
    damping, first, second = v["damping"], v["stiffness_1"], v["stiffness_2"]
    return TransferFunction(num=(damping, first), den=(damping, first + second))


def _spring_lag(v: Values) -> TransferFunction:
    # Spring parallel to damper 1 in the way, damper 2 from the output to the ground.
    first, second, stiffness = v["damping_1"], v["damping_2"], v["stiffness"]
    return TransferFunction(num=(first, stiffness), den=(first + second, stiffness))


def _absorber(v: Values) -> TransferFunction:
    # Balance of both masses, the absorber's displacement eliminated (Den Hartog 1956, section 3.3).
    joint = np.array([v["absorber_damping"], v["absorber_stiffness"]])
    free = np.polyadd([v["absorber_mass"], 0.0, 0.0], joint)
    main = np.polyadd([v["mass"], v["damping"], v["stiffness"]], joint)
    den = np.convolve(main, free) - np.pad(np.convolve(joint, joint), (2, 0))
    return TransferFunction(num=tuple(free), den=tuple(den))


def _mass(value: float = 1.0, name: str = "mass", symbol: str = "m") -> Parameter:
    return declare.constant(name, value, "kg", symbol, "mass")


def _stiffness(value: float = 1e3, name: str = "stiffness", symbol: str = "k", *, unit: str = "N/m") -> Parameter:
    return declare.constant(name, value, unit, symbol, "stiffness")


def _damping(value: float = 5.0, name: str = "damping", symbol: str = "c", *, unit: str = "N s/m") -> Parameter:
    return declare.constant(name, value, unit, symbol, "viscous damping", may_vanish=True)


_M_C_K = Parameters((_mass(), _damping(), _stiffness()))


def _linkage(
    name: str, title: str, formula: str, parameters: Parameters, transfer: Transfer, units: tuple[str, str]
) -> ElementKind:
    return ElementKind(
        name=name,
        title=title,
        formula=formula,
        group="mechanical",
        parameters=parameters,
        transfer=transfer,
        input_unit=units[0],
        output_unit=units[1],
    )


MECHANICAL = (
    _linkage(
        "mass-spring-damper",
        "Mass, spring and damper: displacement from force",
        "1/(m s² + c s + k)",
        _M_C_K,
        _mass_spring_damper,
        ("N", "m"),
    ),
    _linkage(
        "isolator",
        "Vibration isolator: displacement of the mass from that of the ground",
        "(c s + k)/(m s² + c s + k)",
        _M_C_K,
        _isolator,
        ("m", "m"),
    ),
    _linkage(
        "spring-damper",
        "Spring parallel to a damper: displacement from force",
        "1/(c s + k)",
        Parameters((declare.constant("damping", 5.0, "N s/m", "c", "viscous damping"), _stiffness())),
        _spring_damper,
        ("N", "m"),
    ),
    _linkage(
        "inertia",
        "Inertia with viscous friction: angular speed from torque",
        "1/(J s + b)",
        Parameters(
            (
                declare.constant("inertia", 1.0, "kg m^2", "J", "moment of inertia"),
                _damping(0.5, symbol="b", unit="N m s"),
            )
        ),
        _inertia,
        ("N m", "rad/s"),
    ),
    _linkage(
        "shaft",
        "Elastic shaft: torque from the difference of speeds",
        "c + k/s",
        Parameters((_damping(1.0, unit="N m s"), _stiffness(unit="N m"))),
        _shaft,
        ("rad/s", "N m"),
    ),
    _linkage(
        "spring-lead",
        "Mechanical lead: spring 1 and damper in the way, spring 2 to the ground",
        "(c s + k_1)/(c s + k_1 + k_2)",
        Parameters(
            (
                declare.constant("damping", 50.0, "N s/m", "c", "viscous damping"),
                _stiffness(1e3, "stiffness_1", "k_1"),
                _stiffness(4e3, "stiffness_2", "k_2"),
            )
        ),
        _spring_lead,
        ("m", "m"),
    ),
    _linkage(
        "spring-lag",
        "Mechanical lag: spring and damper 1 in the way, damper 2 to the ground",
        "(c_1 s + k)/((c_1 + c_2) s + k)",
        Parameters(
            (
                _damping(50.0, "damping_1", "c_1"),
                declare.constant("damping_2", 200.0, "N s/m", "c_2", "viscous damping"),
                _stiffness(),
            )
        ),
        _spring_lag,
        ("m", "m"),
    ),
    _linkage(
        "absorber",
        "Mass on a spring with a tuned absorber: displacement from force",
        "(m_a s² + c_a s + k_a)/((m s² + c s + k + c_a s + k_a)(m_a s² + c_a s + k_a) - (c_a s + k_a)²)",
        Parameters(
            (
                *_M_C_K.values(),
                # Tuned by Den Hartog's rule for a tenth of the mass: omega_a/omega = 1/1.1, damping ratio 0.17.
                _mass(0.1, "absorber_mass", "m_a"),
                _damping(1.0, "absorber_damping", "c_a"),
                _stiffness(83.0, "absorber_stiffness", "k_a"),
            )
        ),
        _absorber,
        ("N", "m"),
    ),
)
