"""Modes in the HTML report."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from chladni.signals.study import Study
from chladni.viewers.figures import Album
from chladni.viewers.report import report_html
from tests.viewers import synthetic_modes as made
from tests.viewers.test_report import Page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ARM = made.arm_study()


@pytest.fixture(scope="module")
def arm() -> str:
    return report_html(replace(ARM, response=None), interactive=False)


def test_report_holds_the_table_of_modes_with_error_bars(arm: str) -> None:
    page = Page(arm)
    assert page.open == []
    shown = page.texts
    for text in (
        "Modes",
        "Frequency [Hz]",
        "24.6728 ± 0.0049",
        "1.078 ± 0.016",
        "MPC",
        "MPD [deg]",
        "Modal mass [kg]",
        "4.750 ± 0.095",
    ):
        assert text in shown


def test_report_holds_findings_of_the_validation_and_machine_lines(arm: str) -> None:
    shown = Page(arm).texts
    assert "Mode 5 rests on few orders." in shown
    assert "120.0 Hz is no mode: kurtosis 1.52 where noise has 3" in shown
    assert "An advice." in shown


def test_report_holds_relative_motion_and_says_what_it_is(arm: str) -> None:
    shown = Page(arm).texts
    assert "Relative motion between neighbours" in shown
    assert "arm – wrist" in shown
    assert "0.544 ± 0.010" in shown
    assert any("what a damper or a spring between the two adds" in text for text in shown)


def test_relative_motion_of_a_large_structure_is_cut_and_told() -> None:
    study = made.plate_study(4, 3, 2)
    page = Page(report_html(study, album=Album.of(Study(title="no figures"))))
    assert any("The 3 greatest of each mode." in text for text in page.texts)
    assert sum(" – p" in text for text in page.texts) == 6


def test_method_error_and_scale_are_told(arm: str) -> None:
    told = next(text for text in Page(arm).texts if text.startswith("Method: made up."))
    assert "± is one sigma." in told
    assert "Error of the synthesis of the modes: 2.8%." in told
    assert "Scaled at /tool.accel.linear.x over /shaker.wrench.force.x" in told


def test_report_has_every_figure_of_modes_with_its_caption(arm: str) -> None:
    page = Page(arm)
    for heading in ("Mode shapes", "Joints that move", "Poles and fit"):
        assert heading in page.texts
    assert page.tags.count("img") == 7
    assert any("indicator function" in text for text in page.texts)


def test_channels_known_only_from_modes_are_listed() -> None:
    assert "/ring/r3.z" in Page(report_html(made.ring_study())).texts


def test_no_mode_is_an_answer_with_its_reason() -> None:
    page = Page(report_html(made.without_modes()))
    assert "No mode was found." in page.texts
    assert "No pole repeats over the orders." in page.texts
    assert "img" not in page.tags


def test_names_and_notes_are_text() -> None:
    modes = made.modes_of(made.one_mode())
    channels = (replace(modes.channels[0], name="/<script>alert(1)</script>.x"), *modes.channels[1:])
    noted = modes.provenance.with_notes("<b>bold</b>")
    page = Page(
        report_html(Study(title="x", modes=replace(modes, channels=channels, provenance=noted)), interactive=False)
    )
    assert page.open == []
    assert not {"script", "b"} & set(page.tags)
    assert "<b>bold</b>" in page.texts
    assert "/<script>alert(1)</script>.x" in page.texts


@pytest.mark.nightly
@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium; on Debian: apt install chromium")
def test_a_browser_shows_it_without_requests_on_any_screen(arm: str, tmp_path: Path) -> None:
    playwright: Any = pytest.importorskip("playwright.sync_api")
    path = tmp_path / "report.html"
    path.write_text(arm, encoding="utf-8")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        for width in (1200, 380):
            page = chromium.new_page(viewport={"width": width, "height": 900})
            requests: list[str] = []
            page.on("request", lambda request, requests=requests: requests.append(request.url))
            page.goto(path.as_uri())
            assert [url for url in requests if not url.startswith("data:")] == [path.as_uri()]
            assert page.evaluate("[...document.images].every(image => image.complete && image.naturalWidth > 0)")
            # Nothing is wider than the page: tables scroll in themselves.
            assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        chromium.close()
