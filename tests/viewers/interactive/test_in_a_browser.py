"""Plots of a report in a browser: they zoom, read out, follow the colour scheme, and fetch nothing."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.signals.study import Study
from chladni.viewers.figures.album import Album
from chladni.viewers.figures.log_axis import Scales
from chladni.viewers.report import report_html
from tests.viewers import synthetic

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium; on Debian: apt install chromium"),
]
pytest.importorskip("bokeh")

# The plot of a place: its first, with the pixels of its frame on the page.
FRAME = """() => {
  const view = Bokeh.index.roots[0];
  const find = (one) => one.model.type === "Figure" ? one : (one.child_views ?? []).map(find).find((found) => found);
  const plot = find(view);
  const box = plot.el.getBoundingClientRect();
  const frame = plot.frame.bbox;
  const range = plot.model.x_range;
  return {x: box.x + frame.left, y: box.y + frame.top, width: frame.width, height: frame.height,
          start: range.start, end: range.end, ink: plot.model.title.text_color};
}"""
# Words inside the shadow roots of a page, where Bokeh writes its boxes.
WORDS = """() => {
  const words = (root) => [...root.querySelectorAll("*")].flatMap((one) => [
    ...(one.classList.contains("bk-tooltip-row-label") || one.dataset?.value !== undefined ? [one.textContent] : []),
    ...(one.shadowRoot ? words(one.shadowRoot) : [])]);
  return words(document);
}"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


def opened(browser: Any, html: str, path: Path, alarms: list[str], **options: Any) -> Any:
    path.write_text(html, encoding="utf-8")
    page = browser.new_page(viewport={"width": 1280, "height": 900}, **options)
    page.on("request", lambda request: alarms.append(request.url))
    page.on("console", lambda message: alarms.append(message.text))
    page.on("pageerror", lambda error: alarms.append(str(error)))
    page.on("dialog", lambda dialog: alarms.append(dialog.message))
    page.goto(path.as_uri())
    page.wait_for_function("() => Bokeh.index.roots.length > 0")
    page.wait_for_timeout(300)
    alarms[:] = [one for one in alarms if one != path.as_uri() and not one.startswith("data:")]
    return page


@pytest.fixture(scope="module")
def spectra() -> str:
    density = synthetic.density()
    return report_html(Study(title="psd", densities=(density.select([density.channels[3].name]),)))


def test_a_plot_zooms_and_comes_back(browser: Any, spectra: str, tmp_path: Path) -> None:
    alarms: list[str] = []
    page = opened(browser, spectra, tmp_path / "r.html", alarms)
    before = page.evaluate(FRAME)
    assert before["start"] == 0
    page.mouse.move(before["x"] + before["width"] * 0.25, before["y"] + 30)
    page.mouse.down()
    page.mouse.move(before["x"] + before["width"] * 0.5, before["y"] + before["height"] - 30, steps=5)
    page.mouse.up()
    page.wait_for_timeout(200)
    zoomed = page.evaluate(FRAME)
    wanted = before["end"] * np.array([0.25, 0.5])
    np.testing.assert_allclose([zoomed["start"], zoomed["end"]], wanted, atol=before["end"] * 3 / before["width"])
    page.close()
    assert alarms == []


def test_a_plot_reads_out_the_value_under_the_cursor(browser: Any, spectra: str, tmp_path: Path) -> None:
    alarms: list[str] = []
    page = opened(browser, spectra, tmp_path / "r.html", alarms)
    frame, density = page.evaluate(FRAME), synthetic.density()
    line = int(0.3 * density.frequency_hz.size)
    share = density.frequency_hz[line] / frame["end"]
    page.mouse.move(frame["x"] + share * frame["width"], frame["y"] + frame["height"] / 2)
    page.wait_for_timeout(300)
    words = page.evaluate(WORDS)
    assert words[0] == "Frequency [Hz]: "
    assert float(words[1]) == pytest.approx(density.frequency_hz[line], rel=1e-6)
    assert words[2] == "wrist.x: "
    assert float(words[3]) == pytest.approx(density.values[3, line], rel=1e-4)
    page.close()
    assert alarms == []


def test_panes_that_share_a_logarithmic_axis_are_drawn(browser: Any, tmp_path: Path) -> None:
    # The upper of them don't number it; over several decades its numbers have raised exponents.
    alarms: list[str] = []
    response = synthetic.frequency_response()
    decades_hz = np.geomspace(0.01, 100.0, response.frequency_hz.size)
    study = Study(title="frf", response=replace(response, frequency_hz=decades_hz))
    album = Album.of(study, scales=Scales(log_frequency=True))
    page = opened(browser, report_html(study, album=album), tmp_path / "r.html", alarms)
    assert page.query_selector_all(".plot[data-drawn=yes]")
    page.close()
    assert alarms == []


def test_colours_follow_the_scheme_of_the_screen(browser: Any, spectra: str, tmp_path: Path) -> None:
    alarms: list[str] = []
    page = opened(browser, spectra, tmp_path / "r.html", alarms, color_scheme="dark")
    assert page.evaluate(FRAME)["ink"] == "#e4e7ea"
    page.emulate_media(color_scheme="light")
    page.wait_for_timeout(200)
    assert page.evaluate(FRAME)["ink"] == "#1a1d21"
    page.close()


@pytest.mark.nightly
def test_hostile_names_are_drawn_and_neither_run_nor_fetch(browser: Any, tmp_path: Path) -> None:
    alarms: list[str] = []
    study = replace(synthetic.hostile_study(), response=None)
    page = opened(browser, report_html(study), tmp_path / "r.html", alarms)
    page.evaluate("document.querySelectorAll('.plot').forEach((one) => one.scrollIntoView())")
    page.wait_for_timeout(500)
    for place in page.query_selector_all(".plot"):
        place.scroll_into_view_if_needed()
        page.wait_for_timeout(150)
        box = place.bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.wait_for_timeout(100)
    assert page.evaluate("document.querySelectorAll('.plot[data-drawn=yes]').length") == len(
        page.query_selector_all(".plot")
    )
    page.close()
    assert alarms == []
