"""Modes that are picked in the stabilisation chart: by hand, and in Chromium."""

from typing import Any

import numpy as np
import pytest

import chladni
from chladni.apps.picking import open_picking, pick_modes
from chladni.signals.errors import EstimateError, SetupError
from tests.modal import truth
from tests.viewers.bench.serving import browsing, needs_chromium, running

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
CHAIN = truth.chain()
LINES_HZ = np.arange(0.02, 8.0, 0.02)


@pytest.fixture(scope="module")
def response() -> Any:
    return truth.noisy_response(CHAIN, LINES_HZ, (0,), noise=0.01, rng=np.random.default_rng(3))


def same(one: Any, other: Any) -> bool:
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("frequency_hz", "damping_ratio", "shapes", "shape_std")
    )


def row_of(modes: Any, mode: int) -> int:
    """Row of some pole that the mode was taken from."""
    return int(np.flatnonzero(modes.stabilisation.mode == mode)[-1])


def test_it_begins_with_the_automatic_choice_and_the_list_gives_the_same_modes(response: Any) -> None:
    picking = pick_modes(response)
    assert picking.modes.frequency_hz == pytest.approx(CHAIN.frequency_hz, rel=0.01)
    assert same(chladni.identify_modes(response, frequencies_hz=picking.frequencies_hz), picking.modes)


def test_a_pole_is_picked_and_let_go_of(response: Any) -> None:
    picking = pick_modes(response)
    everything, before = picking.frequencies_hz, picking.shown.synthesis.error
    # Noise of 1 %, over a peak that is most of the power.
    assert before < 0.02
    diagram, gone = picking.modes.stabilisation, row_of(picking.modes, 1)
    without = picking.fit(picking.toggle(gone))
    picking.accept(without)
    assert picking.frequencies_hz == (everything[0], *everything[2:])
    assert same(chladni.identify_modes(response, frequencies_hz=picking.frequencies_hz), picking.modes)
    # Without the second mode the synthesis misses its peak, and the MAC is a row smaller.
    assert picking.shown.synthesis.error > 10 * before
    assert picking.shown.mac.shape == (len(everything) - 1,) * 2
    again = np.flatnonzero(
        np.abs(picking.modes.stabilisation.frequency_hz - diagram.frequency_hz[gone]) < 1e-3 * everything[1]
    )
    picking.accept(picking.fit(picking.toggle(int(again[-1]))))
    assert picking.modes.frequency_hz == pytest.approx(CHAIN.frequency_hz, rel=0.01)


def test_none_may_be_picked_and_a_frequency_without_a_mode_changes_nothing(response: Any) -> None:
    picking = pick_modes(response, frequencies_hz=[CHAIN.frequency_hz[0]])
    assert picking.modes.frequency_hz == pytest.approx(CHAIN.frequency_hz[:1], rel=0.01)
    empty = picking.fit(())
    assert empty.modes.frequency_hz.size == 0
    assert not (empty.modes.stabilisation.mode >= 0).any()
    far = 1.3 * CHAIN.frequency_hz[-1]
    with pytest.raises(EstimateError, match=rf"no mode of its own at {far:.4g}"):
        picking.take([float(f"{far:.4g}")])
    assert picking.asked == picking.frequencies_hz == (CHAIN.frequency_hz[0],)


def test_the_diagram_of_modes_begins_with_those_modes(response: Any) -> None:
    modes = chladni.identify_modes(response, count=2)
    picking = modes.stabilisation.pick(response)
    assert picking.modes.frequency_hz == pytest.approx(modes.frequency_hz, rel=1e-3)


def test_a_record_of_responses_alone_is_read_once_and_gives_the_same_modes() -> None:
    record = truth.ambient_record(CHAIN, cycles=600, rng=np.random.default_rng(5))
    picking = pick_modes(record, operational=True)
    first = picking.frequencies_hz[:2]
    assert same(chladni.identify_modes(record, operational=True, frequencies_hz=first), picking.take(first).modes)
    assert picking.shown.response is None


def test_the_list_gives_the_same_modes_of_a_record_whose_lines_are_chosen() -> None:
    record = truth.record(CHAIN, cycles=400, rng=np.random.default_rng(7))
    options = {"references": truth.FORCE.format(0), "band_hz": (0.5, 3.5)}
    picking = pick_modes(record, **options)
    again = chladni.identify_modes(record, frequencies_hz=picking.frequencies_hz, **options)
    assert again.frequency_hz.size == 2
    assert same(again, picking.modes)


def test_a_method_without_model_orders_is_refused(response: Any) -> None:
    with pytest.raises(SetupError, match=r"no stabilisation chart .* take plscf"):
        pick_modes(response, method=chladni.CircleFit())
    with pytest.raises(SetupError, match="pick with operational=True"):
        pick_modes(response, method=chladni.FrequencyDomainDecomposition())


POINT = """([x, y]) => {
  const models = [...Bokeh.documents[0]._all_models.values()];
  const chart = models.find((one) => one.type === "Figure" && one.left.some((axis) => axis.axis_label === "Model order"));
  const view = Bokeh.index.find_one(chart), place = view.el.getBoundingClientRect();
  return [place.left + view.frame.x_scale.compute(x), place.top + view.frame.y_scale.compute(y)];
}"""  # noqa: E501  # one expression


def click(page: Any, diagram: Any, row: int) -> None:
    x, y = page.evaluate(POINT, [float(diagram.frequency_hz[row]), int(diagram.order[row])])
    page.mouse.click(x, y)


def until(page: Any, done: Any) -> bool:
    for _ in range(400):
        if done():
            return True
        page.wait_for_timeout(25)
    return False


@pytest.mark.nightly
@needs_chromium
def test_poles_are_clicked_in_the_browser_and_the_selection_is_kept(response: Any) -> None:
    picking = pick_modes(response)
    everything = picking.frequencies_hz
    server = open_picking(picking)
    with running(server), browsing() as page:
        page.goto(f"{server.address}modes")
        page.locator("canvas").first.wait_for()
        page.get_by_text("This list gives the same modes again").wait_for()
        click(page, picking.modes.stabilisation, row_of(picking.modes, 1))
        assert until(page, lambda: len(picking.frequencies_hz) == len(everything) - 1)
        assert picking.frequencies_hz == (everything[0], *everything[2:])
        listed = ", ".join(f"{one:g}" for one in picking.frequencies_hz)
        page.get_by_text(f"frequencies_hz=[{listed}]").wait_for()
        # Without the second mode, which is still a pole of the fit: both numbers, and what differs.
        alone, whole = picking.shown.synthesis.error, picking.modes.fit.error
        assert alone > 10 * whole
        page.get_by_text(f"The synthesis of these modes alone is {alone:.2%} from").wait_for()
        page.get_by_text(f"That of the modes and one further pole that was found is {whole:.2%} from").wait_for()
        page.get_by_role("button", name="Keep these modes").click()
        page.get_by_text("Kept. The terminal goes on").wait_for()
        assert page.complaints == []
        assert until(page, lambda: server.open_pages == 0 or server._loop.is_closed())
    assert same(chladni.identify_modes(response, frequencies_hz=picking.frequencies_hz), picking.modes)


def test_the_matrix_is_taken_off_the_page_while_fewer_than_two_modes_are_picked(response: Any) -> None:
    pytest.importorskip("panel")
    from chladni.viewers.bench.picking_page import AssuranceChart
    from chladni.viewers.bench.theme import theme

    # One that is only hidden isn't painted anew when it's shown again.
    picking, chart = pick_modes(response), AssuranceChart(theme("light"))
    everything = picking.frequencies_hz
    shown = []
    for modes in (everything, everything[:1], everything[:2]):
        picking.accept(picking.fit(modes))
        chart.show(picking.shown)
        shown.append(len(chart.cells.data["row"]) if chart.view.objects else 0)
    assert shown == [len(everything) ** 2, 0, 4]
