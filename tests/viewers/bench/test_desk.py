from chladni.viewers.bench.desk import Desk
from tests.viewers.bench.stand_in import OSCILLATOR, read


def test_begins_with_what_is_declared() -> None:
    desk = Desk(OSCILLATOR)
    assert desk.asked.values == {"mass": 2.0, "stiffness": 2e4, "damping": 40.0}
    assert desk.asked.options == {"load": "off", "correction": "none"}
    assert desk.asked.label == "as declared"
    assert desk.reading is None


def test_label_tells_what_differs_in_shown_units() -> None:
    desk = Desk(OSCILLATOR)
    desk.turn("stiffness", 3e4)
    assert desk.asked.label == "k 30 N/mm"
    desk.switch("load", "on")
    assert desk.asked.label == "k 30 N/mm, load on"
    desk.turn("mass", 3.0)
    assert desk.asked.label == "m 3 kg, k 30 N/mm and 1 more"


def test_turning_back_is_as_declared_again() -> None:
    desk = Desk(OSCILLATOR)
    desk.turn("mass", 3.0)
    desk.turn("mass", 2.0 * (1 + 1e-15))
    assert desk.asked.label == "as declared"


def test_giving_up_goes_back_to_the_last_good_setting() -> None:
    desk = Desk(OSCILLATOR)
    desk.turn("mass", 3.0)
    good = desk.asked
    desk.accept(good, read(OSCILLATOR, good.values, good.options))
    desk.switch("correction", "unstable")
    assert desk.asked is not good
    desk.give_up()
    assert desk.asked is good
    assert desk.reading is not None


def test_loading_a_setting() -> None:
    desk, other = Desk(OSCILLATOR), Desk(OSCILLATOR)
    other.turn("damping", 10.0)
    desk.load(other.asked)
    assert desk.asked.values["damping"] == 10.0
