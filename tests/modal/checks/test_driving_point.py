"""Driving points of structures in closed form: sound, reversed, beside the point, late."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.modal.checks.driving_point import check_driving_point, driving_points
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.provenance import Provenance
from tests.modal import truth
from tests.modal.made_responses import chain, functions, reversed_channel

F_HZ = np.arange(2.0, 60.0, 0.05)


def only(check):
    (point,) = check.points
    return point


def test_driving_points_are_found_by_point_and_direction():
    made = functions(chain(), F_HZ, references=("m2", "m5"))
    assert driving_points(made.responses, made.references) == ((1, 0, 1), (4, 1, 1))
    turned = [reversed_channel(channel) for channel in made.responses]
    assert driving_points(turned, made.references) == ((1, 0, -1), (4, 1, -1))
    bare = [replace(channel, point=None) for channel in made.responses]
    across = [replace(channel, direction=(0.0, 1.0, 0.0)) for channel in made.responses]
    askew = [replace(channel, direction=(0.99, np.sqrt(1 - 0.99**2), 0.0)) for channel in made.responses]
    for channels in (bare, across, askew, [replace(channel, direction=None) for channel in made.responses]):
        assert driving_points(channels, made.references) == ()


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_sound_driving_point_takes_power_in_and_has_its_antiresonances(order, noise):
    check = check_driving_point(functions(chain(), F_HZ, order=order, noise=noise))
    point = only(check)
    assert point.verdict == "sound"
    assert check.sound
    assert point.wrong_lines == point.wrong_peaks == 0
    assert point.missing_hz == ()
    assert "take power in" in check.finding
    if order == 2 and not noise:
        # All five modes stand out of an exact function; the weakest has a flank too steep to ask for all of four.
        assert (point.peaks, point.pairs) == (5, 3)


def test_a_sensor_upside_down_is_reversed_until_the_setup_says_so():
    made = functions(chain(), F_HZ, noise=0.01)
    upside_down = replace(made, values=-made.values)
    point = only(check_driving_point(upside_down))
    assert point.verdict == "reversed"
    assert point.wrong_peaks == point.peaks >= 3
    assert "turn the sign" in point.finding
    told = replace(upside_down, responses=tuple(reversed_channel(channel) for channel in made.responses))
    assert only(check_driving_point(told)).verdict == "sound"
    assert only(check_driving_point(told)).sign == -1


def test_a_sensor_elsewhere_is_no_driving_point_and_lacks_antiresonances():
    made = functions(chain(), F_HZ, noise=0.003)
    # Measured at m4, said to be at m1.
    wrong = replace(made.responses[3], point="m1", name="/glued elsewhere")
    point = only(
        check_driving_point(
            replace(made, responses=(*_nowhere(made.responses[:3]), wrong, *_nowhere(made.responses[4:])))
        )
    )
    assert point.verdict == "not a driving point"
    assert 0 < point.wrong_peaks < point.peaks
    assert point.missing_hz
    assert "isn't where" in point.finding


def _nowhere(channels):
    return tuple(replace(channel, point=None) for channel in channels)


def test_a_late_sensor_is_a_phase_error_with_its_band():
    made = functions(chain(), F_HZ, noise=1e-4)
    # 20 degrees at 60 Hz: beyond the 5 that are allowed above 15 Hz.
    delay_s = 20 / 360 / 60
    late = replace(made, values=made.values * np.exp(-2j * np.pi * F_HZ * delay_s))
    point = only(check_driving_point(late))
    assert point.verdict == "phase error"
    assert point.wrong_hz[0] > 15
    assert "delay or filter" in point.finding
    small = replace(made, values=made.values * np.exp(-2j * np.pi * F_HZ * delay_s / 5))
    assert only(check_driving_point(small)).verdict == "sound"


def test_noise_alone_is_undecided_at_the_stated_chance():
    wrong = 0
    for seed in range(60):
        made = functions(chain(), F_HZ, noise=30.0, seed=seed)
        wrong += only(check_driving_point(made)).verdict != "undecided"
    # One chance in a hundred each: more than 4 of 60 happen once in 3000 times.
    assert wrong <= 4


def test_without_a_driving_point_the_reason_is_told():
    made = functions(chain(), F_HZ)
    bare = check_driving_point(replace(made, responses=_nowhere(made.responses)))
    assert bare.points == ()
    assert not bare.sound
    assert "/m1.x, /m2.x, /m3.x ... without point or direction" in bare.finding
    elsewhere = functions(chain(), F_HZ, responses=("m2", "m3"))
    assert "stay unscaled" in check_driving_point(elsewhere).finding


def test_functions_without_a_setup_can_be_named():
    made = functions(chain(), F_HZ, references=("m1", "m3"), averages=20.0)
    bare = replace(made, responses=tuple(Channel(name=c.name, unit=c.unit) for c in made.responses))
    check = check_driving_point(bare, functions=[(2, 1, 1), (0, 0, -1)])
    assert [point.verdict for point in check.points] == ["sound", "reversed"]
    assert check.finding == check.points[1].finding
    with pytest.raises(EstimateError, match=r"no function \(7, 0\)"):
        check_driving_point(bare, functions=[(7, 0, 1)])
    with pytest.raises(EstimateError, match="false_alarm"):
        check_driving_point(bare, false_alarm=0.0)


def test_exact_functions_of_a_file_with_resonances_narrower_than_a_line_are_sound():
    # 0.02 % of damping at 1 Hz lines; each highest line lies below or above its resonance.
    structure, lines_hz = truth.chain(first_hz=51.3, damping=2e-4), np.arange(0.0, 400.0)
    exact = truth.noisy_response(structure, lines_hz, (0,), noise=0.0, rng=np.random.default_rng(0))
    file = replace(
        exact,
        std=np.full(exact.std.shape, np.inf),
        coherence=np.full(exact.coherence.shape, np.nan),
        provenance=Provenance(estimator="as in the file"),
    )
    point = only(check_driving_point(file))
    assert (point.verdict, point.peaks, point.pairs, point.missing_hz) == ("sound", 5, 4, ())
    upside_down = replace(file, values=-file.values)
    assert only(check_driving_point(upside_down)).verdict == "reversed"
