"""Elementary transfer functions: proportional, inertial, integral, derivative, dead time."""

from math import pi

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.elements import declare
from chladni.models.elements.element import ElementKind, Values
from chladni.models.elements.transfer_function import TransferFunction


def _p(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["gain"],))


def _pt1(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["gain"],), den=(v["time_constant"], 1))


def _pt2(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["gain"],), den=pair(v["time_constant"], v["damping_ratio"]))


def _i(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["gain"],), den=(1, 0))


def _it1(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["gain"],), den=(v["time_constant"], 1, 0))


def _d(v: Values) -> TransferFunction:
    # One number only: a gain beside the time would be the same knob twice.
    return TransferFunction(num=(v["derivative_time"], 0))


def _dt1(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["derivative_time"], 0), den=(v["time_constant"], 1))


def _pd(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["gain"] * v["derivative_time"], v["gain"]))


def _pdt1(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["gain"] * v["derivative_time"], v["gain"]), den=(v["time_constant"], 1))


def _pd2(v: Values) -> TransferFunction:
    return TransferFunction(num=tuple(v["gain"] * c for c in pair(v["time_constant"], v["damping_ratio"])))


def _dead_time(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["gain"],), delay_s=v["delay"])


def _all_pass(v: Values) -> TransferFunction:
    # 1 - T s and not T s - 1, so that it passes what is steady without turning its sign.
    return TransferFunction(num=(-v["gain"] * v["time_constant"], v["gain"]), den=(v["time_constant"], 1))


def pair(time_constant_s: float, damping_ratio: float) -> tuple[float, float, float]:
    """Coefficients of T^2 s^2 + 2 zeta T s + 1."""
    # A product overflows to infinity, which is refused in words; a power would raise.
    return time_constant_s * time_constant_s, 2 * damping_ratio * time_constant_s, 1.0


def pair_at(frequency_hz: float, damping_ratio: float) -> tuple[float, float, float]:
    """Coefficients of s^2/omega^2 + 2 zeta s/omega + 1."""
    return pair(1 / (2 * pi * frequency_hz), damping_ratio)


def _time_constant(value: float = 0.1) -> Parameter:
    return declare.time("time_constant", value, "T", "time constant")


def _derivative_time(value: float = 0.1) -> Parameter:
    return declare.time("derivative_time", value, "T_D", "derivative time", may_vanish=True)


BASIC = (
    ElementKind(
        name="p", title="P, proportional", formula="K", group="basic", parameters=Parameters((declare.gain(),)),
        transfer=_p,
    ),
    ElementKind(
        name="pt1", title="PT1, proportional inertial of first order", formula="K/(T s + 1)", group="basic",
        parameters=Parameters((declare.gain(), _time_constant())), transfer=_pt1,
    ),
    ElementKind(
        name="pt2", title="PT2, proportional inertial of second order", formula="K/(T² s² + 2 ζ T s + 1)",
        group="basic", parameters=Parameters((declare.gain(), _time_constant(), declare.damping_ratio(0.3))),
        transfer=_pt2,
    ),
    ElementKind(
        name="i", title="I, integral", formula="K/s", group="basic",
        parameters=Parameters((declare.gain(unit="1/s"),)), transfer=_i,
    ),
    ElementKind(
        # What a drive is from its command to its position.
        name="it1", title="IT1, integral inertial", formula="K/(s (T s + 1))", group="basic",
        parameters=Parameters((declare.gain(unit="1/s"), _time_constant())), transfer=_it1,
    ),
    ElementKind(
        name="d", title="D, derivative", formula="T_D s", group="basic",
        parameters=Parameters((_derivative_time(),)), transfer=_d,
    ),
    ElementKind(
        name="dt1", title="DT1, derivative inertial", formula="T_D s/(T s + 1)", group="basic",
        parameters=Parameters((_derivative_time(), _time_constant())), transfer=_dt1,
    ),
    ElementKind(
        name="pd", title="PD, proportional derivative", formula="K (T_D s + 1)", group="basic",
        parameters=Parameters((declare.gain(), _derivative_time())), transfer=_pd,
    ),
    ElementKind(
        name="pdt1", title="PDT1, proportional derivative inertial (anticipative)",
        formula="K (T_D s + 1)/(T s + 1)", group="basic",
        parameters=Parameters((declare.gain(), _derivative_time(0.5), _time_constant())), transfer=_pdt1,
    ),
    ElementKind(
        name="pd2", title="PD2, proportional, derivative of second order", formula="K (T² s² + 2 ζ T s + 1)",
        group="basic", parameters=Parameters((declare.gain(), _time_constant(), declare.damping_ratio(0.3))),
        transfer=_pd2,
    ),
    ElementKind(
        name="dead-time", title="Dead time", formula="K exp(-T_t s)", group="basic",
        parameters=Parameters((declare.gain(), declare.time("delay", 0.1, "T_t", "dead time", may_vanish=True))),
        transfer=_dead_time,
    ),
    ElementKind(
        name="all-pass", title="All-pass of first order", formula="K (1 - T s)/(1 + T s)", group="basic",
        parameters=Parameters((declare.gain(), _time_constant())), transfer=_all_pass,
    ),
)  # fmt: skip
