import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.core.parameter import Parameter
from chladni.signals.errors import ModelError, SetupError
from chladni.viewers.bench.knob_scale import STEPS, KnobScale

AREA = Parameter(name="area", value=0.007, unit="m^2", low=0.005, high=0.008, minimum=0.0, shown_unit="cm^2")


def test_a_typed_number_is_in_the_shown_unit() -> None:
    assert KnobScale.of(AREA).read(" 65 ") == pytest.approx(0.0065, rel=1e-15)


def test_a_typed_quantity_may_have_any_fitting_unit() -> None:
    assert KnobScale.of(AREA).read("6500 mm^2") == pytest.approx(0.0065, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("-5", "area = -5 cm² is not possible; give a value of at least 0 cm²"),
        ("3 kg", "area = '3 kg' is in kg; give a number in cm²"),
        ("nan", "area = 'nan' is not finite; give a value of at least 0 cm²"),
        ("inf", "area = 'inf' is not finite; give a value of at least 0 cm²"),
    ],
)
def test_what_is_refused(text: str, line: str) -> None:
    with pytest.raises((ModelError, SetupError)) as caught:
        KnobScale.of(AREA).read(text)
    assert str(caught.value) == line


@pytest.mark.parametrize("text", ["", "wide", "1,5", "__import__('os')"])
def test_what_is_no_number_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(SetupError) as caught:
        KnobScale.of(AREA).read(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("minimum", "maximum", "advice"),
    [
        (0.0, 1.0, "give a value from 0 to 1"),
        (-math.inf, 1.0, "give a value of at most 1"),
        (0.0, math.inf, "give a value of at least 0"),
    ],
)
def test_the_line_names_what_is_possible(minimum: float, maximum: float, advice: str) -> None:
    share = Parameter(name="share", value=0.5, low=0.1, high=0.9, minimum=minimum, maximum=maximum)
    outside = "2" if maximum == 1.0 else "-1"
    with pytest.raises(ModelError, match=advice):
        KnobScale.of(share).read(outside)


def test_a_range_of_orders_of_magnitude_turns_by_them() -> None:
    stiff = Parameter(name="stiffness", value=1e5, unit="N/m", low=1e3, high=1e8)
    scale = KnobScale.of(stiff)
    assert (scale.logarithmic, scale.start, scale.end) == (True, 3.0, 8.0)
    assert scale.place(1e5) == pytest.approx(5.0)
    assert scale.value(6.0) == 1e6
    assert scale.place(-1.0) == scale.start


def test_a_value_outside_the_usual_range_lies_at_the_end_of_the_slider() -> None:
    assert KnobScale.of(AREA).place(1.0) == 80.0


def test_a_range_without_width_gets_one() -> None:
    fixed = Parameter(name="exponent", value=1.4, low=1.4, high=1.4)
    scale = KnobScale.of(fixed)
    assert scale.start < 1.4 < scale.end


def test_usual_range_in_words() -> None:
    assert KnobScale.of(AREA).usual_range() == "usually 50 to 80 cm²"


@given(
    low=st.floats(1e-9, 1e6), width=st.floats(1.001, 1e6), share=st.floats(0, 1),
    unit=st.sampled_from([("m", "mm"), ("m^2", "cm^2"), ("N", ""), ("Pa", "bar"), ("1", "%")]),
)  # fmt: skip
def test_place_and_value_are_each_others_inverse(
    low: float, width: float, share: float, unit: tuple[str, str]
) -> None:
    parameter = Parameter(name="p", value=low, unit=unit[0], shown_unit=unit[1], low=low, high=low * width)
    scale = KnobScale.of(parameter)
    place = scale.start + share * (scale.end - scale.start)
    # A logarithmic knob gives three digits, which is 0.5 % of a value; a linear one twelve.
    tolerance = 0.0051 / math.log(10) if scale.logarithmic else 1e-10 * max(abs(scale.start), abs(scale.end))
    assert scale.place(scale.value(place)) == pytest.approx(place, abs=tolerance)


# Sizes that no model works with are refused before.
@given(low=st.floats(-1e6, 1e6).map(lambda low: round(low, 9)), width=st.floats(1e-6, 1e6))
def test_steps_are_round_and_as_many_as_a_hand_can_turn(low: float, width: float) -> None:
    scale = KnobScale.of(Parameter(name="p", value=low, low=low, high=low + width))
    if scale.logarithmic:
        return
    steps = (scale.end - scale.start) / scale.step
    assert STEPS * (1 - 1e-6) <= steps <= 2.5 * STEPS * (1 + 1e-6)
    assert f"{scale.step:.0e}"[0] in "125"
