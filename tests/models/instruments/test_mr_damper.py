import numpy as np
import pytest

from chladni.models.analysis.instrument_reading import read_instrument
from chladni.models.instruments.mr_damper import INSTRUMENT


def charts(values=None, options=None):
    return {chart.name: chart for chart in read_instrument(INSTRUMENT, values, options).charts}


@pytest.mark.parametrize("law", ["paper", "asymmetric"])
def test_loops_grow_with_current_and_close(law):
    shown = charts({"current": 0.6}, {"law": law})
    assert list(shown) == ["loop.displacement", "loop.velocity", "equivalent-damping"]
    loops = shown["loop.displacement"].curves
    assert [curve.label for curve in loops] == ["0 A", "0.25 A", "0.5 A", "0.6 A (now)", "0.75 A", "1 A"]
    peaks = [np.abs(curve.y).max() for curve in loops]
    assert peaks == sorted(peaks)
    for curve, other in zip(loops, shown["loop.velocity"].curves, strict=True):
        assert curve.y[0] == pytest.approx(curve.y[-1], abs=0.02 * np.abs(curve.y).max())
        assert np.abs(curve.x).max() == pytest.approx(20.0, rel=1e-3)
        assert np.abs(other.x).max() == pytest.approx(0.02 * np.pi, rel=1e-3)
        assert other.y == pytest.approx(curve.y)


def test_the_current_of_the_knob_is_marked_once_and_the_knobs_of_the_sinus_act():
    shown = charts({"current": 0.5, "stroke": 0.01, "frequency": 1.0})
    labels = [curve.label for curve in shown["loop.velocity"].curves]
    assert labels == ["0 A", "0.25 A", "0.5 A (now)", "0.75 A", "1 A"]
    assert np.abs(shown["loop.displacement"].curves[0].x).max() == pytest.approx(10.0, rel=1e-3)


def test_equivalent_damping_is_the_energy_of_a_period():
    shown = charts({"current": 1.0, "alpha_scale": 0.0, "c0_scale": 1e3, "c1_scale": 0.1})
    damping = shown["equivalent-damping"].curves[0]
    # Without a loop and with a stiff c0 the two dampers in series give c0 c1/(c0 + c1), nearly c1.
    c0, c1 = 1e3 * 7202.4, 0.1 * 117719.0
    assert damping.y[-1] == pytest.approx(c0 * c1 / (c0 + c1), rel=2e-3)
    assert np.all(np.diff(damping.y) > 0)


def test_a_stroke_far_beyond_the_measured_still_gives_a_loop():
    for stroke in (0.2, 1.0):
        loops = charts({"stroke": stroke}, {"law": "asymmetric"})["loop.displacement"].curves
        assert all(np.all(np.isfinite(curve.y)) for curve in loops)


def test_a_current_outside_of_the_measured_is_flagged():
    flags = read_instrument(INSTRUMENT, {"current": 1.2}).flags
    assert any("current" in flag for flag in flags)
    assert not read_instrument(INSTRUMENT).flags
