"""PID regulators: PI, PID, and the PID whose derivative is filtered."""

from chladni.models.core.parameter import Parameters
from chladni.models.elements import declare
from chladni.models.elements.element import ElementKind, Values
from chladni.models.elements.transfer_function import TransferFunction


def _pi(v: Values) -> TransferFunction:
    gain, integral = v["gain"], v["integral_time"]
    return TransferFunction(num=(gain * integral, gain), den=(integral, 0))


def _pid(v: Values) -> TransferFunction:
    gain, integral, derivative = v["gain"], v["integral_time"], v["derivative_time"]
    return TransferFunction(num=(gain * integral * derivative, gain * integral, gain), den=(integral, 0))


def _pidt1(v: Values) -> TransferFunction:
    gain, integral, derivative, filter_ = v["gain"], v["integral_time"], v["derivative_time"], v["filter_time"]
    # K (1 + 1/(T_I s) + T_D s/(T s + 1)) over the common denominator T_I s (T s + 1).
    return TransferFunction(
        num=(gain * integral * (derivative + filter_), gain * (integral + filter_), gain),
        den=(integral * filter_, integral, 0),
    )


# The filter is a tenth of the derivative time and that a tenth of the integral time: each part has its own decade.
# Standard form: one gain before all three parts, so that a knob for time moves one part only.
_GAIN = declare.gain(meaning="proportional gain")
_INTEGRAL = declare.time("integral_time", 1.0, "T_I", "integral (reset) time")
_DERIVATIVE = declare.time("derivative_time", 0.1, "T_D", "derivative (rate) time", may_vanish=True)
_FILTER = declare.time("filter_time", 0.01, "T", "time constant of the derivative's filter")

REGULATORS = (
    ElementKind(
        name="pi", title="PI regulator", formula="K (1 + 1/(T_I s))", group="regulator",
        parameters=Parameters((_GAIN, _INTEGRAL)), transfer=_pi,
    ),
    ElementKind(
        name="pid", title="PID regulator, ideal", formula="K (1 + 1/(T_I s) + T_D s)", group="regulator",
        parameters=Parameters((_GAIN, _INTEGRAL, _DERIVATIVE)), transfer=_pid,
    ),
    ElementKind(
        name="pidt1", title="PID regulator with filtered derivative",
        formula="K (1 + 1/(T_I s) + T_D s/(T s + 1))", group="regulator",
        parameters=Parameters((_GAIN, _INTEGRAL, _DERIVATIVE, _FILTER)), transfer=_pidt1,
    ),
)  # fmt: skip
