"""Coefficients of one measured damper, which the instrument and the effect use when they're given no others."""

from typing import Final

from chladni.models.drives.mr_coefficients import MrAsymmetry, MrCoefficients

_DATA: Final = (
    "four published logs of one MR damper in a press: sinus stroke of 25 mm at 0.5 Hz with 0, 0.5 and 1 A in the "
    "coil, 10 mm at 1 Hz with 1 A"
)
_HOW: Final = "fitted on all four at once, second order in current (three currents determine no more), k1 >= 0"

#: Largest motion of the logs: beyond it the coefficients are a guess.
MEASURED_STROKE_M: Final = 0.0245
MEASURED_VELOCITY: Final = 0.079

#: The paper's law: RMS error over RMS force 9.8 % (0 A), 6.9 % (0.5 A), 7.8 % (1 A), 6.0 % (10 mm, 1 A).
MEASURED_DAMPER: Final = MrCoefficients(
    alpha=(146.068, 1071.72, -177.247),
    c0=(634.864, 6603.35, -35.7590),
    c1=(11102.0, 68954.7, 37662.3),
    k0=(923.824, 432.027, -193.603),
    k1=7.34176,
    x0=0.0639875,
    beta=-26795.5,
    gamma=28709.4,
    delta=1913.96,
    n=2.55159,
    lowest_current_a=0.0,
    highest_current_a=1.0,
    origin=f"{_DATA}; equation 5, {_HOW}",
)

#: With compression, rest and extension apart: 6.2 % (0 A), 4.5 % (0.5 A), 5.9 % (1 A), 5.3 % (10 mm, 1 A).
MEASURED_DAMPER_ASYMMETRIC: Final = MrCoefficients(
    alpha=(53.6696, 447.422, -76.3236),
    c0=(596.465, 4922.28, 276.065),
    c1=(137210.0, 914882.0, 210784.0),
    k0=(227.891, -166.679, 172.810),
    k1=75.3100,
    x0=0.0502744,
    beta=-100296.0,
    gamma=107460.0,
    delta=7164.00,
    n=3.35307,
    asymmetry=MrAsymmetry(
        alpha_sides=-0.0270227,
        c0_sides=0.198008,
        c1_sides=0.0340033,
        k0_sides=-2.0,
        k1_sides=-209.019,
        alpha_moving=0.992327,
        c1_moving=-2.94471,
        yield_moving=1.50232,
        speed=0.00628533,
    ),
    lowest_current_a=0.0,
    highest_current_a=1.0,
    origin=f"{_DATA}; equation 5 with compression, rest and extension apart, {_HOW}",
)
