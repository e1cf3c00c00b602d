from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.comparison.log_against_log import compare_logs
from chladni.gap.records.measurement import Measurement
from chladni.signals.errors import LogError
from tests.gap.comparison import made_measurements as made

SAMPLES = 6000


def pair() -> tuple[Measurement, Measurement]:
    """A machine, and a simulation of it in which the second mode is 20 % too strong on the first output."""
    rng = np.random.default_rng(1)
    force = rng.standard_normal(SAMPLES)
    weights = made.weights(2, 1)
    wrong = weights * np.array([[1.0, 1.2, 1.0], [1.0, 1.0, 1.0]])
    clean = made.machine(force, weights)
    measured = made.measurement(
        force, clean + 0.01 * clean.std(axis=1, keepdims=True) * rng.standard_normal(clean.shape)
    )
    return measured, made.measurement(force, made.machine(force, wrong), log="simulated.mcap")


def test_where_the_simulation_is_wrong_is_told() -> None:
    measured, simulated = pair()
    found = compare_logs(measured, simulated)
    np.testing.assert_array_equal(found.residual, measured.outputs - simulated.outputs)
    first, second = found.where.channels
    assert (first.name, second.name) == ("acc1", "acc2")
    assert first.gap > 5 * first.noise
    # The second output is right: its gap is its noise, each known to 1/sqrt(2 x 6000) and the floor's own std.
    assert second.gap == pytest.approx(0.01, rel=0.05)
    assert second.noise == pytest.approx(0.01, rel=0.05)
    loudest = max(found.where.bands, key=lambda band: band.share)
    assert loudest.low_hz < 0.054 * made.RATE_HZ < loudest.high_hz
    assert found.gap == pytest.approx(np.sqrt((first.gap**2 + second.gap**2) / 2))
    assert found.where.sites == ()
    assert found.map_density.shape == (found.map_time_s.size, found.map_frequency_hz.size)
    assert found.remarks == ()


def test_outputs_are_matched_by_name_and_lone_ones_told() -> None:
    measured, simulated = pair()
    swapped = replace(simulated, outputs=simulated.outputs[::-1], output_names=("acc2", "other"))
    found = compare_logs(measured, swapped)
    assert [channel.name for channel in found.where.channels] == ["acc2"]
    np.testing.assert_array_equal(found.residual[0], measured.outputs[1] - simulated.outputs[1])
    assert any("acc1" in remark for remark in found.remarks)
    assert any("other" in remark for remark in found.remarks)


def test_the_longer_log_is_cut_and_told() -> None:
    measured, simulated = pair()
    short = replace(simulated, inputs=simulated.inputs[:, :5000], outputs=simulated.outputs[:, :5000])
    found = compare_logs(measured, short)
    assert found.residual.shape == (2, 5000)
    assert any("made.mcap is cut to the 10 s" in remark for remark in found.remarks)


def test_an_input_that_differs_is_told() -> None:
    measured, simulated = pair()
    found = compare_logs(measured, replace(simulated, inputs=1.1 * simulated.inputs))
    assert any("'force1' differs by 0.1" in remark for remark in found.remarks)


def test_what_cannot_be_compared_is_refused() -> None:
    measured, simulated = pair()
    with pytest.raises(LogError, match=r"made.mcap has 500 Hz, simulated.mcap 400 Hz"):
        compare_logs(measured, replace(simulated, sample_rate_hz=400.0))
    with pytest.raises(LogError, match="share no output"):
        compare_logs(measured, replace(simulated, output_names=("a", "b")))
    with pytest.raises(LogError, match=r"'acc1' is in m/s\^2"):
        compare_logs(measured, replace(simulated, output_units=("m", "m/s^2")))


def test_when_the_simulation_is_wrong_is_told() -> None:
    measured, _ = pair()
    off = measured.outputs.copy()
    off[0, 2000:3000] *= 0.5
    (time,) = compare_logs(measured, replace(measured, outputs=off)).where.times
    assert (time.start_s, time.end_s) == (pytest.approx(4.0, abs=0.2), pytest.approx(6.0, abs=0.2))
    assert time.share > 0.99


def test_what_a_simulation_lacks_of_distortion_is_told_beside_the_measured_one() -> None:
    rng = np.random.default_rng(3)
    odd = np.arange(11, 300, 4)
    force = np.tile(made.multisine(rng, 2000, odd), 6)
    linear = made.machine(force, made.weights(1, 1))
    linear /= linear.std()
    # A cube is odd: on three tones of odd lines it answers with odd lines only.
    measured = made.measurement(force, linear + 0.1 * linear**3 + 1e-3 * rng.standard_normal(linear.shape))
    found = compare_logs(measured, made.measurement(force, linear, log="simulated.mcap"))
    assert found.measured_split is not None
    assert found.simulated_split is not None
    (ours,), (theirs,) = found.measured_split.shares, found.simulated_split.shares
    assert (ours.odd > 0.005, theirs.odd < 1e-3) == (True, True)
    assert max(ours.even, theirs.even) < 1e-3
    assert theirs.linear > 0.999
    assert compare_logs(*pair()).measured_split is None
