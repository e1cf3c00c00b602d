"""Order cuts: a phase is drawn where there is an amplitude to have one."""

import numpy as np
from matplotlib.figure import Figure

from chladni.signals.channel import Channel
from chladni.signals.order_spectra import OrderCuts
from chladni.viewers.figures.orders import draw_order_phases


def test_phases_of_amplitudes_that_are_noise_are_left_out() -> None:
    turns = np.exp(1j * np.linspace(0.0, 1.0, 5))
    cuts = OrderCuts(
        orders=np.array([1.0, 2.0]),
        time_s=np.arange(5.0),
        speed_hz=np.full(5, 10.0),
        values=np.stack([10.0 * turns, 0.05 * turns])[np.newaxis],
        channels=(Channel(name="a", unit="m/s^2"),),
        start_time_ns=0,
        method="angle",
    )
    axes = Figure().subplots()
    draw_order_phases(axes, cuts, 0)
    first, second = (np.asarray(line.get_ydata()) for line in axes.lines)
    np.testing.assert_allclose(first, np.rad2deg(np.linspace(0.0, 1.0, 5)))
    assert np.isnan(second).all()
