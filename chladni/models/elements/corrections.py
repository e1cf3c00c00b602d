"""Corrections: lead, lag, lead-lag, notch, and the realisable PD2."""

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.elements import declare
from chladni.models.elements.basic import pair, pair_at
from chladni.models.elements.element import ElementKind, Values
from chladni.models.elements.transfer_function import TransferFunction


def _lead(v: Values) -> TransferFunction:
    gain, time_s = v["gain"], v["time_constant"]
    return TransferFunction(num=(gain * v["ratio"] * time_s, gain), den=(time_s, 1))


def _lag(v: Values) -> TransferFunction:
    gain, time_s = v["gain"], v["time_constant"]
    return TransferFunction(num=(gain * time_s, gain), den=(v["ratio"] * time_s, 1))


def _lead_lag(v: Values) -> TransferFunction:
    lead_s, lag_s, ratio = v["lead_time"], v["lag_time"], v["ratio"]
    above = v["gain"] * np.polymul([lead_s, 1], [lag_s, 1])
    return TransferFunction(num=tuple(above), den=tuple(np.polymul([lead_s / ratio, 1], [lag_s * ratio, 1])))


def _notch(v: Values) -> TransferFunction:
    above = pair_at(v["frequency"], v["notch_damping"])
    return TransferFunction(num=tuple(v["gain"] * c for c in above), den=pair_at(v["frequency"], v["damping_ratio"]))


def _pd2t2(v: Values) -> TransferFunction:
    above = pair(v["derivative_time"], v["derivative_damping"])
    return TransferFunction(num=tuple(v["gain"] * c for c in above), den=pair(v["time_constant"], v["damping_ratio"]))


_FREQUENCY = Parameter(
    name="frequency",
    value=5.0,
    unit="Hz",
    low=0.1,
    high=100.0,
    minimum=1e-9,
    symbol="f",
    meaning="middle of the notch",
)

# A ratio of 5 turns the phase by asin(4/6) = 42 degrees, about what one lead is asked for; the notch goes down to
# 0.05/0.7, a fourteenth; PD2T2 has its poles a decade beyond its zeros, out of the way of the pair that those cancel.
CORRECTIONS = (
    ElementKind(
        name="lead", title="Lead", formula="K (α T s + 1)/(T s + 1)", group="correction",
        parameters=Parameters((
            declare.gain(),
            declare.time("time_constant", 0.1, "T", "time constant of the pole"),
            declare.ratio(5.0, "α", "time constant of the zero over that of the pole"),
        )),
        transfer=_lead,
    ),
    ElementKind(
        name="lag", title="Lag", formula="K (T s + 1)/(β T s + 1)", group="correction",
        parameters=Parameters((
            declare.gain(),
            declare.time("time_constant", 1.0, "T", "time constant of the zero"),
            declare.ratio(5.0, "β", "time constant of the pole over that of the zero"),
        )),
        transfer=_lag,
    ),
    ElementKind(
        name="lead-lag", title="Lead-lag",
        formula="K (T_1 s + 1)(T_2 s + 1)/((T_1 s/α + 1)(α T_2 s + 1))", group="correction",
        parameters=Parameters((
            declare.gain(),
            declare.time("lead_time", 0.1, "T_1", "time constant of the zero that leads"),
            declare.time("lag_time", 1.0, "T_2", "time constant of the zero of the lag"),
            declare.ratio(5.0, "α", "how far each pole is from its zero"),
        )),
        transfer=_lead_lag,
    ),
    ElementKind(
        name="notch", title="Notch", formula="K (s² + 2 ζ_z ω s + ω²)/(s² + 2 ζ ω s + ω²), ω = 2 π f",
        group="correction",
        parameters=Parameters((
            declare.gain(),
            _FREQUENCY,
            declare.damping_ratio(0.05, "notch_damping", "ζ_z"),
            declare.damping_ratio(0.7),
        )),
        transfer=_notch,
    ),
    ElementKind(
        name="pd2t2", title="PD2T2, PD2 made realisable by a lag of second order",
        formula="K (T_D² s² + 2 ζ_D T_D s + 1)/(T² s² + 2 ζ T s + 1)", group="correction",
        parameters=Parameters((
            declare.gain(),
            declare.time("derivative_time", 0.1, "T_D", "time constant of the zeros"),
            declare.damping_ratio(0.3, "derivative_damping", "ζ_D"),
            declare.time("time_constant", 0.01, "T", "time constant of the poles"),
            declare.damping_ratio(0.7),
        )),
        transfer=_pd2t2,
    ),
)  # fmt: skip
