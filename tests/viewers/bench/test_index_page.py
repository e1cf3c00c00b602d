from dataclasses import replace

from chladni.viewers.bench.index_page import MANY, index_page
from tests.viewers.bench.stand_in import OSCILLATOR


def test_each_instrument_has_a_card_with_its_knobs_and_options() -> None:
    text = index_page([OSCILLATOR])
    assert (
        '<a href="/oscillator"><b>Oscillator &lt;one body&gt;</b><span>3 knobs; load, correction</span></a>' in text
    )
    assert "<h2>" not in text
    assert "<script" not in text


def test_many_of_one_kind_stand_apart() -> None:
    elements = [replace(OSCILLATOR, name=f"element-{number}", title=f"E{number}, a<b") for number in range(MANY)]
    text = index_page([OSCILLATOR, *elements])
    assert text.index("/oscillator") < text.index("<h2>Elements</h2>") < text.index("/element-0")
    assert "<b>E0</b><span>a&lt;b</span>" in text
    assert "<h2>" not in index_page(elements[:-1])
    formula = [replace(one, title="Notch: K (s + 1)/s, w = 2 pi f") for one in elements]
    assert "<b>Notch</b><span>K (s + 1)/s, w = 2 pi f</span>" in index_page(formula)
