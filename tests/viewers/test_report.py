"""The HTML report: whole in itself, escaped, and as a browser shows it."""

import base64
import io
import shutil
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.image import imread

from chladni.signals.envelope import FaultLine
from chladni.signals.errors import LogError
from chladni.signals.study import Study
from chladni.signals.visible import visible
from chladni.spectral.envelope import envelope
from chladni.viewers.figures import Album
from chladni.viewers.report import report_html, write_report
from chladni.viewers.report.markup import element, escaped, table
from chladni.viewers.screen_colours import with_dark_scheme
from tests.viewers import synthetic

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


def in_a_browser(test: Any) -> Any:
    """Mark a test that needs chromium."""
    missing = pytest.mark.skipif(CHROMIUM is None, reason="no chromium; on Debian: apt install chromium")
    return pytest.mark.browser(missing(test))


class Page(HTMLParser):
    """Tags, texts and addresses of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.open: list[str] = []
        self.attributes: list[tuple[str, str]] = []
        self.texts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]
        if tag not in {"meta", "img"}:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


@pytest.fixture(scope="module")
def arm() -> str:
    return report_html(synthetic.study(), interactive=False)


@pytest.fixture(scope="module")
def hostile() -> str:
    # Spectra alone show every name; the other figures have the same way with names.
    return report_html(replace(synthetic.hostile_study(), waterfalls=(), response=None), interactive=False)


def test_report_holds_findings_peaks_channels_and_method(arm: str) -> None:
    page = Page(arm)
    assert page.open == []
    shown = page.texts
    for text in (
        "arm.mcap",
        "Two resonances stand out, at 12.5 Hz and 31 Hz.",
        "12.500 ± 0.021",
        "(m/s²)²/Hz",
        "/wrist.accel.linear.x",
        "reference",
        "hann",
        "17.4",
    ):
        assert text in shown
    assert page.tags.count("img") == 8


def test_report_fetches_nothing_and_runs_nothing(hostile: str) -> None:
    page = Page(hostile)
    assert page.open == []
    assert not {"script", "iframe", "object", "embed", "link", "base", "form"} & set(page.tags)
    assert not [name for name, _ in page.attributes if name.startswith("on")]
    addresses = [value for name, value in page.attributes if name in {"src", "href", "srcset", "action"}]
    assert addresses
    assert all(address.startswith("data:image/svg+xml;base64,") for address in addresses)
    assert any(value.startswith("default-src 'none'") for name, value in page.attributes if name == "content")


def test_names_of_channels_are_text(hostile: str) -> None:
    texts = Page(hostile).texts
    for name in synthetic.HOSTILE_NAMES:
        assert visible(name) in texts
    assert "<b>bad</b> $x$.mcap" in texts


@given(text=st.text())
def test_any_text_comes_back_as_the_same_text(text: str) -> None:
    page = Page(element("p", escaped(text), title=escaped(text)))
    assert page.tags == ["p"]
    assert "".join(page.texts) == visible(text)


def test_a_table_without_rows_is_nothing() -> None:
    assert table(("a",), []) == ""


def test_a_study_of_nothing_is_still_a_page() -> None:
    page = Page(report_html(Study(title="nothing")))
    assert page.open == []
    assert "nothing" in page.texts
    assert "table" not in page.tags


def test_channels_known_only_from_spectra_are_listed() -> None:
    page = Page(report_html(Study(title="psd", densities=(synthetic.density(),))))
    assert "/wrist.accel.linear.x" in page.texts


def test_advice_of_the_estimators_is_printed_once() -> None:
    density = synthetic.density()
    noted = replace(density, provenance=density.provenance.with_notes("resolution is too <coarse>"))
    page = Page(report_html(Study(title="psd", densities=(noted, noted))))
    assert page.texts.count("resolution is too <coarse>") == 1


def test_what_stands_among_the_findings_is_told_once_and_its_channels_are_listed() -> None:
    response = synthetic.frequency_response()
    noted = replace(response, provenance=replace(response.provenance, notes=("told as a finding", "told here")))
    page = report_html(Study(title="s", response=noted, findings=("told as a finding",)), interactive=False)
    assert page.count("told as a finding") == page.count("told here") == 1
    channels = page.partition("<h2>Channels</h2>")[2].partition("<h2>")[0]
    for channel in (*response.references, *response.responses):
        assert channel.name in channels
    # Without waveforms no rate is known; a column of nothing is none.
    assert "Rate [Hz]" not in channels


def test_report_is_the_same_every_time() -> None:
    study = Study(title="psd", densities=(synthetic.density(),))
    assert report_html(study) == report_html(study)


def test_figures_that_are_drawn_already_are_used() -> None:
    nothing = Album.of(Study(title="nothing"))
    assert "img" not in Page(report_html(synthetic.study(), album=nothing)).tags
    album = Album.of(Study(title="psd", densities=(synthetic.density(),)))
    page = report_html(Study(title="psd"), album=album, interactive=False)
    for name in album.figures:
        assert base64.b64encode(with_dark_scheme(album.rendered(name, "svg").decode()).encode()).decode() in page


def test_writing_is_whole_or_not_at_all(tmp_path: Path) -> None:
    path = write_report(Study(title="é"), tmp_path / "report.html")
    assert "é" in path.read_text(encoding="utf-8")
    with pytest.raises(LogError, match="folder"):
        write_report(Study(title="x"), tmp_path / "missing" / "report.html")
    assert [entry.name for entry in tmp_path.iterdir()] == ["report.html"]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@in_a_browser
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_is_shown_without_requests_or_scripts(browser: Any, hostile: str, tmp_path: Path, scheme: str) -> None:
    path = tmp_path / "report.html"
    path.write_text(hostile, encoding="utf-8")
    page = browser.new_page(viewport={"width": 1200, "height": 900}, color_scheme=scheme)
    requests: list[str] = []
    alarms: list[str] = []
    page.on("request", lambda request: requests.append(request.url))
    page.on("dialog", lambda dialog: alarms.append(dialog.message))
    page.on("console", lambda message: alarms.append(message.text))
    page.on("pageerror", lambda error: alarms.append(str(error)))
    page.goto(path.as_uri())
    assert [url for url in requests if not url.startswith("data:")] == [path.as_uri()]
    assert alarms == []
    assert page.evaluate("document.scripts.length") == 0
    assert page.evaluate("[...document.images].every(image => image.complete && image.naturalWidth > 0)")
    # Nothing is wider than the page.
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    picture = imread(io.BytesIO(page.screenshot()), format="png")[:, :, :3]
    corner = float(np.mean(picture[:20, :20]))
    assert corner > 0.95 if scheme == "light" else corner < 0.2
    page.close()


@in_a_browser
def test_a_phone_scrolls_tables_not_the_page(browser: Any, arm: str, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_text(arm, encoding="utf-8")
    page = browser.new_page(viewport={"width": 380, "height": 700})
    page.goto(path.as_uri())
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    page.close()


@in_a_browser
def test_print_has_dark_ink_whatever_the_screen(browser: Any, arm: str, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_text(arm, encoding="utf-8")
    page = browser.new_page(color_scheme="dark")
    page.emulate_media(media="print", color_scheme="dark")
    page.goto(path.as_uri())
    assert page.evaluate("getComputedStyle(document.body).color") == "rgb(0, 0, 0)"
    page.close()


@pytest.mark.nightly
def test_a_report_of_envelopes_lists_its_channels_and_tells_of_a_bearing_where_there_is_one() -> None:
    noise = np.random.default_rng(4).standard_normal(8192)
    (spectrum,) = envelope(noise, band_hz=(100, 300), sample_rate_hz=1000.0)
    page = report_html(Study(title="s", envelopes=(spectrum,)), interactive=False)
    assert spectrum.channel.name in page.partition("<h2>Channels</h2>")[2].partition("<h2>")[0]
    assert "of the bearing" not in page
    line = FaultLine(name="BPFO", expected_hz=20.0, found_hz=20.0, amplitude=1.0, over_background=9.0)
    bearing = report_html(Study(title="s", envelopes=(replace(spectrum, faults=(line,)),)), interactive=False)
    assert "Dashed: frequencies of the bearing" in bearing
