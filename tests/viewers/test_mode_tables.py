"""Modes in words."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.signals.relative_motion import RelativeMotion
from chladni.viewers.mode_tables import advice, between, hertz, mode_table, mode_ticks, mode_title, motion_table
from chladni.viewers.style import Style
from tests.viewers import synthetic_modes as made

STUDY = made.arm_study()
MODES = made.modes_of(STUDY)
STYLE = Style.of(STUDY)


@pytest.mark.parametrize(
    ("frequency_hz", "text"),
    [(0.12345, "0.1235"), (1.5, "1.500"), (24.672, "24.67"), (999.96, "1000"), (1000.0, "1000"), (12345.6, "12346")],
)
def test_frequencies_have_four_digits_and_no_powers_of_ten(frequency_hz: float, text: str) -> None:
    assert hertz(frequency_hz) == text


def test_titles_tell_number_frequency_and_damping() -> None:
    assert mode_title(MODES, 0) == "1: 24.67 Hz, 1.08 %"
    assert mode_ticks(MODES)[4] == "5: 169.3"


def test_table_has_error_bars_and_what_is_known() -> None:
    headings, rows = mode_table(MODES, STUDY.validation)
    assert headings == (
        "Mode",
        "Frequency [Hz]",
        "Damping [%]",
        "MPC",
        "MPD [deg]",
        "Modal mass [kg]",
        "Orders",
    )
    assert rows[0] == ("1", "24.6728 ± 0.0049", "1.078 ± 0.016", "0.999", "0.4", "4.750 ± 0.095", "20")
    assert len(rows) == 5


def test_table_leaves_out_what_is_not_known() -> None:
    modes = replace(MODES, scale=None, spread=None)
    headings, rows = mode_table(modes, None)
    assert headings == ("Mode", "Frequency [Hz]", "Damping [%]")
    assert rows[1] == ("2", "47.9714 ± 0.0096", "1.896 ± 0.028")
    assert mode_table(made.modes_of(made.without_modes()), None) == (headings, [])


def test_a_sigma_that_is_not_known_is_not_printed() -> None:
    modes = replace(MODES, frequency_std_hz=np.full(5, np.nan), damping_std=np.full(5, np.inf))
    assert mode_table(modes, None)[1][0][1:3] == ("24.67", "1.078")


def test_modal_mass_is_in_kilograms_only_for_a_force_and_a_translation() -> None:
    torque = replace(MODES.references[0], unit="N m")
    assert "Modal mass" in mode_table(replace(MODES, references=(torque,)), None)[0]


def test_relative_motion_is_by_mode_the_greatest_first() -> None:
    headings, rows = motion_table(STUDY.relative_motion, MODES, STYLE)
    assert headings == ("Mode", "Frequency [Hz]", "Between", "Ratio", "Δζ [% per N s/m]", "Δf [Hz per N/m]")
    assert [row[0] for row in rows] == [str(mode) for mode in (1, 2, 3, 4, 5) for _ in range(4)]
    assert rows[0] == ("1", "24.67", "arm – wrist", "0.544 ± 0.010", "0.001", "2e-06")
    for mode in range(5):
        ratios = [float(row[3].split()[0]) for row in rows[4 * mode : 4 * mode + 4]]
        assert ratios == sorted(ratios, reverse=True)


def test_neighbours_without_a_common_direction_are_named_and_come_last() -> None:
    channel = MODES.channels[0].name
    crossed = RelativeMotion(mode=0, between=(channel, "tool"), ratio=None, ratio_std=None)
    plain = RelativeMotion(mode=0, between=("base", "arm"), ratio=0.0, ratio_std=None)
    headings, rows = motion_table((crossed, plain), MODES, STYLE)
    assert headings == ("Mode", "Frequency [Hz]", "Between", "Ratio")
    assert [row[2:] for row in rows] == [("base – arm", "0"), ("base.x – tool", "no common direction")]


def test_long_names_of_neighbours_are_shortened_in_the_middle() -> None:
    motion = RelativeMotion(mode=0, between=("payload_rail_right", "base"), ratio=0.1, ratio_std=None)
    assert between(motion, STYLE, longest=10) == "payl…right – base"
    assert between(motion, STYLE) == "payload_rail_right – base"


def test_gains_that_one_pair_lacks_are_left_empty() -> None:
    bare = RelativeMotion(mode=4, between=("a", "b"), ratio=0.5, ratio_std=0.1)
    _, rows = motion_table((*STUDY.relative_motion, bare), MODES, STYLE)
    assert ("5", "169.3", "a – b", "0.50 ± 0.10", "", "") in rows


def test_advice_is_findings_machine_lines_and_notes_once_each() -> None:
    noted = replace(MODES, provenance=MODES.provenance.with_notes("Mode 5 rests on few orders."))
    assert advice(STUDY, noted) == [
        "5 modes, all shapes are told apart.",
        "Mode 5 rests on few orders.",
        "120.0 Hz is no mode: kurtosis 1.52 where noise has 3",
        "An advice.",
    ]
    assert advice(replace(STUDY, validation=None), MODES)[0].startswith("120.0 Hz")


def test_what_is_told_elsewhere_is_not_repeated() -> None:
    assert STUDY.response is not None
    response = replace(STUDY.response, provenance=STUDY.response.provenance.with_notes("An advice."))
    told = advice(replace(STUDY, response=response), MODES, told=("Mode 5 rests on few orders.",))
    assert told == ["5 modes, all shapes are told apart.", "120.0 Hz is no mode: kurtosis 1.52 where noise has 3"]


def test_motions_without_any_common_direction_make_no_table() -> None:
    apart = RelativeMotion(mode=0, between=("base", "arm"), ratio=None, ratio_std=None)
    assert motion_table((apart, apart), MODES, STYLE)[1] == []
