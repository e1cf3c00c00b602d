"""Electrical networks of resistors, coils and capacitors, unloaded at their output."""

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.elements import declare
from chladni.models.elements.element import ElementKind, Transfer, Values
from chladni.models.elements.transfer_function import TransferFunction


def _rc_low_pass(v: Values) -> TransferFunction:
    return TransferFunction(num=(1,), den=(v["resistance"] * v["capacitance"], 1))


def _rc_high_pass(v: Values) -> TransferFunction:
    time_s = v["resistance"] * v["capacitance"]
    return TransferFunction(num=(time_s, 0), den=(time_s, 1))


def _rl_low_pass(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["resistance"],), den=(v["inductance"], v["resistance"]))


def _rl_high_pass(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["inductance"], 0), den=(v["inductance"], v["resistance"]))


def _rl_current(v: Values) -> TransferFunction:
    return TransferFunction(num=(1,), den=(v["inductance"], v["resistance"]))


def _rlc_denominator(v: Values) -> tuple[float, float, float]:
    return v["inductance"] * v["capacitance"], v["resistance"] * v["capacitance"], 1.0


def _rlc(v: Values) -> TransferFunction:
    return TransferFunction(num=(1,), den=_rlc_denominator(v))


def _rlc_band_pass(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["resistance"] * v["capacitance"], 0), den=_rlc_denominator(v))


def _rlc_band_stop(v: Values) -> TransferFunction:
    return TransferFunction(num=(v["inductance"] * v["capacitance"], 0, 1), den=_rlc_denominator(v))


def _rc_lead(v: Values) -> TransferFunction:
    # R_1 parallel to C in the way, R_2 across the output.
    first, second, capacitance = v["resistance_1"], v["resistance_2"], v["capacitance"]
    return TransferFunction(
        num=(first * second * capacitance, second), den=(first * second * capacitance, first + second)
    )


def _rc_lag(v: Values) -> TransferFunction:
    # R_1 in the way, R_2 and C in series across the output.
    first, second, capacitance = v["resistance_1"], v["resistance_2"], v["capacitance"]
    return TransferFunction(num=(second * capacitance, 1), den=((first + second) * capacitance, 1))


def _rc_lead_lag(v: Values) -> TransferFunction:
    # R_1 parallel to C_1 in the way, R_2 and C_2 in series across the output: each loads the other, hence R_1 C_2.
    first_s = v["resistance_1"] * v["capacitance_1"]
    second_s = v["resistance_2"] * v["capacitance_2"]
    above = np.polymul([first_s, 1.0], [second_s, 1.0])
    return TransferFunction(
        num=tuple(above), den=tuple(np.polyadd(above, [v["resistance_1"] * v["capacitance_2"], 0]))
    )


def _resistance(name: str = "resistance", symbol: str = "R", value: float = 1e3) -> Parameter:
    return declare.constant(name, value, "ohm", symbol, "resistance")


def _capacitance(name: str = "capacitance", symbol: str = "C", value: float = 1e-6) -> Parameter:
    return declare.constant(name, value, "F", symbol, "capacitance", shown_unit="uF")


def _inductance() -> Parameter:
    return declare.constant("inductance", 0.1, "V s/A", "L", "inductance")


# Defaults of one millisecond each; with both, 500 Hz at a damping ratio of 0.16, so that resonance shows.
_RC = Parameters((_resistance(), _capacitance()))
_RL = Parameters((_resistance(value=100.0), _inductance()))
_RLC = Parameters((_resistance(value=100.0), _inductance(), _capacitance()))
_R1_R2_C = Parameters((_resistance("resistance_1", "R_1"), _resistance("resistance_2", "R_2"), _capacitance()))


def _network(
    name: str, title: str, formula: str, parameters: Parameters, transfer: Transfer, output_unit: str = "V"
) -> ElementKind:
    return ElementKind(
        name=name,
        title=title,
        formula=formula,
        group="electrical",
        parameters=parameters,
        transfer=transfer,
        input_unit="V",
        output_unit=output_unit,
    )


ELECTRICAL = (
    _network("rc-low-pass", "RC low-pass", "1/(R C s + 1)", _RC, _rc_low_pass),
    _network("rc-high-pass", "RC high-pass", "R C s/(R C s + 1)", _RC, _rc_high_pass),
    _network("rl-low-pass", "RL low-pass, voltage of the resistor", "R/(L s + R)", _RL, _rl_low_pass),
    _network("rl-high-pass", "RL high-pass, voltage of the coil", "L s/(L s + R)", _RL, _rl_high_pass),
    _network("rl-current", "RL circuit, current (an armature)", "1/(L s + R)", _RL, _rl_current, "A"),
    _network("rlc", "RLC circuit, voltage of the capacitor", "1/(L C s² + R C s + 1)", _RLC, _rlc),
    _network(
        "rlc-band-pass", "RLC circuit, voltage of the resistor", "R C s/(L C s² + R C s + 1)", _RLC, _rlc_band_pass
    ),
    _network(
        "rlc-band-stop",
        "RLC circuit, voltage of coil and capacitor",
        "(L C s² + 1)/(L C s² + R C s + 1)",
        _RLC,
        _rlc_band_stop,
    ),
    _network(
        "rc-lead",
        "Lead network (R_1 parallel to C, then R_2)",
        "R_2 (R_1 C s + 1)/(R_1 R_2 C s + R_1 + R_2)",
        _R1_R2_C,
        _rc_lead,
    ),
    _network(
        "rc-lag",
        "Lag network (R_1, then R_2 and C in series)",
        "(R_2 C s + 1)/((R_1 + R_2) C s + 1)",
        _R1_R2_C,
        _rc_lag,
    ),
    _network(
        "rc-lead-lag",
        "Lead-lag network (R_1 parallel to C_1, then R_2 and C_2 in series)",
        "(R_1 C_1 s + 1)(R_2 C_2 s + 1)/((R_1 C_1 s + 1)(R_2 C_2 s + 1) + R_1 C_2 s)",
        Parameters(
            (
                _resistance("resistance_1", "R_1", 1e4),
                _capacitance("capacitance_1", "C_1"),
                _resistance("resistance_2", "R_2"),
                _capacitance("capacitance_2", "C_2", 1e-5),
            )
        ),
        _rc_lead_lag,
    ),
)
