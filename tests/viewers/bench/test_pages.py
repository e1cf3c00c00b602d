"""Pages in a real browser."""

import json
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from chladni.viewers.bench import serve
from chladni.viewers.bench.instrument_page import VIEWS
from tests.viewers.bench.serving import (
    browsing,
    curves,
    needs_chromium,
    open_page,
    running,
    until_back,
    until_changed,
    until_drawn,
)
from tests.viewers.bench.stand_in import OSCILLATOR, read, tools

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


class Counting:
    """Reads like the stand-in, remembers what was asked, and takes as long as told."""

    def __init__(self) -> None:
        self.asked: list[dict[str, float]] = []
        self.seconds = 0.0
        self.threads: set[str] = set()

    def __call__(self, instrument: Any, values: Any, options: Any, charts: Any) -> Any:
        self.asked.append(dict(values))
        self.threads.add(threading.current_thread().name)
        time.sleep(self.seconds)
        return read(instrument, values, options, charts)


READ = Counting()


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rows") / "masses.txt"
    path.write_text("3\n")
    return path


@pytest.fixture(scope="module")
def address(rows: Path) -> Iterator[str]:
    other = replace(OSCILLATOR, name="watched", title="Watched")
    server = serve([OSCILLATOR], tools(read=READ))
    watched = serve([other], tools(), variants=rows)
    # A file is looked at once a second; here nobody types into it.
    with pytest.MonkeyPatch.context() as patch, running(server), running(watched):
        patch.setattr("chladni.viewers.bench.variants_view.WATCH_MS", 100)
        yield f"{server.address} {watched.address}watched"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with browsing() as page:
        yield page


def back_at_the_start(browser: Any) -> bool:
    """Whether a user's way back leads there, which is faster than loading the page again."""
    browser.get_by_role("button", name=VIEWS[0], exact=True).click()
    browser.get_by_role("button", name="Reset").click()
    # What a log has drawn stays.
    return len(curves(browser)) == len(browser.start) and until_back(browser, browser.start)


@pytest.fixture
def page(browser: Any, address: str) -> Iterator[Any]:
    READ.seconds = 0.0
    browser.complaints.clear()
    own = address.split()[0] + "oscillator"
    if browser.url != own or not back_at_the_start(browser):
        browser.asked.clear()
        open_page(browser, own)
        browser.start = curves(browser)
    yield browser
    assert browser.complaints == []


@needs_chromium
def test_every_script_and_font_comes_from_this_server(page: Any, address: str) -> None:
    assert len(page.asked) > 5
    foreign = [url for url in page.asked if not url.startswith((address.split()[0], "data:", "blob:"))]
    assert foreign == []


@needs_chromium
def test_index_leads_to_the_page(page: Any, address: str) -> None:
    page.goto(address.split()[0])
    page.get_by_text("Oscillator <one body>").click()
    page.locator(".noUi-handle").first.wait_for()
    assert page.url.endswith("/oscillator")


@needs_chromium
def test_arrow_keys_turn_a_knob_and_the_curves_follow(page: Any) -> None:
    before = curves(page)
    assert len(before) == 4
    page.locator(".noUi-handle").first.focus()
    page.keyboard.press("ArrowRight")
    after = until_changed(page, before)
    assert all(one != other for one, other in zip(after, before, strict=True))
    # A knob of 1 to 5 kg turns by 0.02 kg, the largest round hundredth of its range.
    assert READ.asked[-1]["mass"] == pytest.approx(2.02)
    page.wait_for_function("() => true")
    assert page.locator("input[type=text]").first.input_value() == "2.02"


@pytest.mark.nightly
@needs_chromium
def test_tab_reaches_knobs_entries_and_buttons(page: Any) -> None:
    reached = set()
    for _ in range(30):
        page.keyboard.press("Tab")
        reached.add(
            page.evaluate(
                """() => { let at = document.activeElement;
                  while (at.shadowRoot && at.shadowRoot.activeElement) { at = at.shadowRoot.activeElement; }
                  return at.getAttribute("role") || at.type || at.tagName; }"""
            )
        )
    assert {"slider", "text", "checkbox", "select-one", "button"} <= reached | {"button"} & reached


@needs_chromium
def test_an_impossible_value_is_refused_and_the_curves_stay(page: Any) -> None:
    before = curves(page)
    entry = page.locator("input[type=text]").first
    entry.fill("-3")
    entry.press("Enter")
    page.get_by_text("mass = -3 kg is not possible; give a value of at least 0.01 kg").wait_for()
    assert curves(page) == before
    assert entry.input_value() == "2"
    entry.fill("2500 g")
    entry.press("Enter")
    # g is gravity; a mass in it is another mistake, told in the same place.
    page.get_by_text("is in").wait_for()
    entry.fill("3")
    entry.press("Enter")
    assert until_changed(page, before) != before
    page.locator(".m.error").wait_for(state="detached")


@pytest.mark.nightly
@needs_chromium
def test_a_setting_that_has_no_reading_keeps_the_last_good_one(page: Any) -> None:
    before = curves(page)
    page.locator("select").first.select_option("unstable")
    page.get_by_text("has a pole at +3 rad/s").wait_for()
    page.get_by_text("the last good state stays").wait_for()
    assert curves(page) == before
    page.wait_for_function("() => true")
    assert page.locator("select").first.input_value() == "none"


@pytest.mark.nightly
@needs_chromium
def test_the_last_of_thirty_keys_wins_and_few_readings_are_taken(page: Any) -> None:
    READ.seconds = 0.15
    READ.asked.clear()
    page.locator(".noUi-handle").first.focus()
    for _ in range(30):
        page.keyboard.press("ArrowRight")
    begun = time.monotonic()
    while (not READ.asked or READ.asked[-1]["mass"] != pytest.approx(2.6)) and time.monotonic() - begun < 20:
        page.wait_for_timeout(50)
    # 30 steps of 0.02 kg; thirty readings of 0.15 s would be in line otherwise.
    assert READ.asked[-1]["mass"] == pytest.approx(2.6)
    page.wait_for_timeout(400)
    assert len(READ.asked) < 20
    assert page.locator("input[type=text]").first.input_value() == "2.6"


@needs_chromium
def test_readings_are_taken_off_the_pages_thread(page: Any) -> None:
    assert READ.threads
    assert all(name.startswith("chladni-bench") for name in READ.threads)


@pytest.mark.nightly
@needs_chromium
def test_one_setting_comes_as_one_patch(page: Any) -> None:
    frames: list[Any] = []
    with page.expect_websocket() as opened:
        page.reload()
    opened.value.on("framereceived", lambda frame: frames.append(frame))
    page.locator(".noUi-handle").first.wait_for()
    page.wait_for_timeout(300)
    frames.clear()
    before = curves(page)
    page.locator(".noUi-handle").first.focus()
    page.keyboard.press("ArrowRight")
    until_changed(page, before)
    patches = [json.loads(one) for one in frames if isinstance(one, str) and '"events"' in one]
    with_curves = [one for one in patches if any(event.get("attr") == "data" for event in one["events"])]
    # Four lines, one of points: all in one.
    assert len(with_curves) == 1
    assert sum(event.get("attr") == "data" for event in with_curves[0]["events"]) == 5


@needs_chromium
def test_kept_variants_stay_as_faded_curves_with_a_chip(page: Any) -> None:
    drawn = len(curves(page))
    page.get_by_role("button", name="Keep this variant").click()
    chip = page.get_by_role("button", name="as declared")
    chip.wait_for()
    # The chip and the curves come in messages of their own.
    assert until_drawn(page, 2 * drawn) == 2 * drawn
    page.get_by_role("button", name=VIEWS[2], exact=True).click()
    page.get_by_role("columnheader", name="now: as declared").wait_for()
    page.get_by_role("button", name=VIEWS[0], exact=True).click()
    chip.click()
    chip.wait_for(state="detached")
    assert until_drawn(page, drawn) == drawn


@pytest.mark.nightly
@needs_chromium
def test_influence_is_computed_when_one_looks(page: Any) -> None:
    page.get_by_role("button", name=VIEWS[1], exact=True).click()
    page.get_by_text("+1.02", exact=True).first.wait_for()
    assert page.get_by_text("strongest of its row").is_visible()


@pytest.mark.nightly
@needs_chromium
def test_a_dropped_log_shows_beside_the_simulation_and_is_removed(page: Any, tmp_path: Path) -> None:
    page.get_by_role("button", name=VIEWS[3], exact=True).click()
    log = {
        "name": "press <1>.mcap",
        "mimeType": "application/octet-stream",
        "buffer": b"log\n/cell.force\n/rod.position",
    }
    page.locator("input[type=file]").set_input_files(log)
    page.get_by_text("NRMSE position").wait_for()
    assert page.locator("select").filter(has_text="/rod.position").count() == 2
    before = curves(page)
    assert len(before) >= 2
    page.locator("input[type=file]").set_input_files({**log, "buffer": b"rubbish"})
    page.get_by_text("press <1>.mcap: is no log; record it as MCAP").wait_for()
    assert curves(page) == before


@needs_chromium
def test_the_model_file_is_saved_with_the_values_on_the_page(page: Any) -> None:
    entry = page.locator("input[type=text]").first
    before = curves(page)
    entry.fill("4")
    entry.press("Enter")
    until_changed(page, before)
    with page.expect_download() as saved:
        page.get_by_role("button", name="Model file").click()
    assert saved.value.suggested_filename == "oscillator.toml"
    assert Path(saved.value.path()).read_text() == "mass = 4.0"


@pytest.mark.nightly
@needs_chromium
def test_reset_goes_back(page: Any) -> None:
    before = curves(page)
    page.locator(".noUi-handle").first.focus()
    page.keyboard.press("PageUp")
    assert until_changed(page, before) != before
    page.get_by_role("button", name="Reset").click()
    assert until_back(page, before)


@pytest.mark.nightly
@needs_chromium
def test_the_page_fits_a_window_of_1280_by_800(page: Any) -> None:
    last = page.locator("canvas:visible").last.bounding_box()
    assert last is not None
    assert last["y"] + last["height"] <= 800
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 1280


#: Overhang of each chart's canvas over its figure, in pixels, and the figures' heights together.
CHARTS_JS = """() => {
  const parts = (root) => [...root.querySelectorAll("*")]
    .flatMap((part) => [part, ...(part.shadowRoot ? parts(part.shadowRoot) : [])]);
  const figures = parts(document).filter((part) => part.matches(".bk-Figure") && part.offsetParent);
  const sizes = figures.map((figure) => {
    const canvas = parts(figure.shadowRoot).find((part) => part.matches("canvas"));
    return [figure.getBoundingClientRect(), canvas.getBoundingClientRect()];
  });
  return {
    over: Math.max(...sizes.map(([figure, canvas]) => Math.abs(canvas.bottom - figure.bottom))),
    height: sizes.reduce((sum, [figure]) => sum + figure.height, 0),
  };
}"""


@pytest.mark.nightly
@needs_chromium
def test_charts_keep_their_axes_when_what_stands_above_them_grows(page: Any) -> None:
    """Style and messages come after the first layout."""
    page.wait_for_function(f"() => ({CHARTS_JS})().over < 1")
    before = page.evaluate(CHARTS_JS)["height"]
    # Not the row of the table.
    strip = page.locator("span").get_by_text("overshoot", exact=True)
    for padding, charts in (("60px", f"height < {before - 60}"), ("", f"height > {before - 1}")):
        strip.evaluate(f"(words) => {{ words.getRootNode().host.style.paddingTop = '{padding}'; }}")
        page.wait_for_function(f"() => ({CHARTS_JS})().{charts}")
        page.wait_for_function(f"() => ({CHARTS_JS})().over < 1")
    assert abs(page.evaluate(CHARTS_JS)["height"] - before) <= 1


@pytest.mark.nightly
@needs_chromium
def test_dark_ground(page: Any) -> None:
    page.get_by_text("dark", exact=True).click()
    page.locator(".noUi-handle").first.wait_for()
    assert page.url.endswith("?theme=dark")
    fills = page.evaluate(
        """() => [...Bokeh.documents[0]._all_models.values()].filter((model) => model.type === "Figure")
          .map((model) => model.background_fill_color)"""
    )
    assert set(fills) == {"#1a2028"}


@pytest.mark.nightly
@needs_chromium
def test_a_dark_screen_gets_the_dark_page_unless_the_address_asks_for_the_light_one(page: Any, address: str) -> None:
    own = address.split()[0] + "oscillator"
    page.emulate_media(color_scheme="dark")
    try:
        page.goto(own)
        page.wait_for_url("**?theme=dark")
        page.locator(".noUi-handle").first.wait_for()
        open_page(page, f"{own}?theme=light")
        assert page.url.endswith("?theme=light")
    finally:
        page.emulate_media(color_scheme="light")


@pytest.mark.nightly
@needs_chromium
def test_rows_of_a_file_appear_while_it_grows(browser: Any, address: str, rows: Path) -> None:
    page = open_page(browser, address.split()[1])
    page.get_by_role("button", name="row m 3").wait_for()
    before = curves(page)
    rows.write_text("3\n4\nheavy\n")
    page.get_by_role("button", name="row m 4").wait_for()
    page.get_by_text("'heavy' is no mass; give a number in kg").wait_for()
    assert until_changed(page, before) != before
    page.goto("about:blank")
