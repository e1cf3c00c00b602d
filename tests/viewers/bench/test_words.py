import numpy as np

from chladni.models.core.reading import InfluenceTable, Quantity
from chladni.viewers.bench.words import influence_table, message, number, quantity_strip, quantity_table

EVIL = "<script>alert(1)</script>"
SHORT = Quantity(name="answer_time", value=0.0123456, unit="s", definition='until 5 % "inside"')


def test_numbers() -> None:
    assert [number(value) for value in (0.0, -0.5, 1e-9, None, float("nan"), float("inf"))] == [
        "0", "−0.5", "1e-09", "–", "–", "–",
    ]  # fmt: skip


def test_a_strip_says_value_unit_name_and_definition() -> None:
    text = quantity_strip([SHORT])
    assert "<b>0.01235 s</b>" in text
    assert "<span>answer time</span>" in text
    assert 'title="until 5 % &quot;inside&quot;"' in text


def test_what_has_no_value_is_named_last() -> None:
    text = quantity_strip([Quantity(name="overshoot", value=None, unit="%"), SHORT])
    assert text.index("answer time") < text.index("none: ") < text.index("overshoot")


def test_what_comes_from_outside_is_escaped() -> None:
    evil = Quantity(name=EVIL, value=1.0, unit=EVIL, definition=EVIL)
    missing = Quantity(name=EVIL, value=None, unit="1", definition=EVIL)
    table = InfluenceTable(
        behaviour=(EVIL,), construction=(EVIL,), nominal=np.ones(1), change=np.ones(1),
        relative_change=np.ones((1, 1)), finite=np.ones((1, 1)), log_derivative=np.ones((1, 1)), definitions=(EVIL,),
    )  # fmt: skip
    for text in (
        quantity_strip([evil, missing]),
        quantity_table([(EVIL, EVIL, [evil])]),
        message(EVIL, [EVIL]),
        influence_table(table),
    ):
        assert "<script" not in text


def test_variants_stand_side_by_side_and_a_missing_number_is_a_dash() -> None:
    other = Quantity(name="overshoot", value=12.0, unit="%")
    text = quantity_table([("now", "#000", [SHORT]), ("kept", "#fff", [other])])
    assert "answer time</td><td>0.01235 s</td><td>–</td>" in text
    assert "overshoot</td><td>–</td><td>12 %</td>" in text


def test_the_strongest_of_rows_and_columns_are_marked() -> None:
    finite = np.array([[0.5, -2.0], [1.0, 0.0]])
    table = InfluenceTable(
        behaviour=("t", "f"), construction=("area", "mass"), nominal=np.array([0.1, np.nan]),
        change=np.array([-0.1, 0.15]), relative_change=finite, finite=finite, log_derivative=finite / 2,
        definitions=("time", "frequency"),
    )  # fmt: skip
    text = influence_table(table)
    assert "<td>+0.50<small>+0.25</small></td>" in text
    assert '<td class="column"><b>−2.00</b><small>−1.00</small></td>' in text
    assert '<td class="column"><b>+1.00</b><small>+0.50</small></td>' in text
    # R = (initial - final)/initial: a growth of 10 % is -0.1.
    assert "(+10 %)" in text
    assert "(-15 %)" in text


def test_nothing_is_strongest_where_nothing_acts() -> None:
    zero = np.zeros((1, 1))
    table = InfluenceTable(
        behaviour=("t",), construction=("a",), nominal=np.ones(1), change=np.ones(1), relative_change=zero,
        finite=np.full((1, 1), np.nan), log_derivative=zero, definitions=("",),
    )  # fmt: skip
    assert "<td>–<small>0</small></td>" in influence_table(table)


def test_no_message_when_all_is_well() -> None:
    assert message("", ()) == ""
    assert 'role="alert">broken<' in message("broken", ("flag",))
