"""PD2: proportional correction with first and second derivative, made realisable by a declared filter."""

from typing import Final

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Terminal
from chladni.models.core.state_space import StateSpace
from chladni.models.elements.realization import state_space
from chladni.models.elements.transfer_function import TransferFunction

# Defaults: `best_pd2` for the hydraulic motor as it comes, the flow bounded to twice the step.
PD2_PARAMETERS: Final = Parameters(
    (
        # Numbers of a regulator are what they are set to: no tolerance.
        Parameter(
            name="pd2_gain", value=1.0, low=0.2, high=5.0, minimum=0.0, maximum=1e6, symbol="K", tolerance=0.0,
            meaning="of the PD2 correction for slow signals",
        ),
        Parameter(
            name="pd2_derivative", value=1.53e-3, unit="s", low=0.0, high=2e-2, minimum=-10.0, maximum=10.0,
            symbol="T_1", shown_unit="ms", tolerance=0.0, meaning="weight of the first derivative",
        ),
        Parameter(
            name="pd2_second_derivative", value=2.05e-5, unit="s^2", low=0.0, high=4e-4, minimum=-100.0, maximum=1e2,
            symbol="T_2", shown_unit="(ms)^2", tolerance=0.0, meaning="weight of the second derivative",
        ),
        # The paper prints none; without it a step would ask for an impulse of flow.
        Parameter(
            name="pd2_filter", value=3.205e-3, unit="s", low=1e-4, high=2e-2, minimum=1e-7, maximum=10.0,
            symbol="T_f", shown_unit="ms", tolerance=0.0, meaning="of the two lags that make PD2 buildable",
        ),
    )
)  # fmt: skip


def pd2(
    *,
    gain: float,
    derivative_s: float,
    second_derivative_s2: float,
    filter_s: float,
    entry: Terminal,
    exit_: Terminal,
) -> StateSpace:
    """State space of the correction, two states.

    ::

        C(s) = K (1 + T_1 s + T_2 s^2) / (1 + T_f s)^2

    A step is answered at once by ``K T_2/T_f^2``, and in the end by K.
    """
    transfer = TransferFunction(
        num=(gain * second_derivative_s2, gain * derivative_s, gain), den=(filter_s**2, 2 * filter_s, 1.0)
    )
    return state_space(transfer, entry=entry, exit_=exit_)
