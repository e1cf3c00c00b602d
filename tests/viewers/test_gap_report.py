"""The HTML report of a diagnosis."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import chladni
from chladni.apps.gap_evidence import gap_evidence
from chladni.viewers.figures.album import Album
from chladni.viewers.report.gap import gap_report_html, write_gap_report
from tests import made_diagnosis as made
from tests.viewers.test_report import Page

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
NO_FIGURES = Album({})


@pytest.fixture(scope="module")
def arm() -> str:
    return gap_report_html(gap_evidence(made.periodic()), interactive=False)


def test_the_report_begins_with_the_answer(arm: str) -> None:
    page = Page(arm)
    assert page.open == []
    texts = [text for text in page.texts if text.strip()]
    start = texts.index("Answer")
    assert texts[start - 2] == "arm: the gap to arm.mcap"
    assert texts[start + 1] == "Most likely Coulomb friction of 8.10 ± 0.20 N at elbow (97 %)."
    assert any(text.startswith("Repeat at half the level") for text in texts)


def test_the_report_holds_every_table_and_the_law(arm: str) -> None:
    shown = Page(arm).texts
    for text in (
        "Output", "acc_wrist", "20 ± 50 mN", "-130.2", "not determined", "6.8 %",
        "The largest drop of the error alone would have named hysteresis at elbow.",
        "The closing was measured on 4 s that no fit saw, in 2 of its stretches.",
        "shoulder.damping is not determined by this log and was held.",
    ):  # fmt: skip
        assert text in shown
    assert any("F = force tanh(s/creep_speed) + offset (regularised)" in text for text in shown)


def test_a_law_that_several_joints_share_is_told_once() -> None:
    both = replace(made.diagnosis(), causes=(made.friction(), replace(made.friction(), site="shoulder")))
    shown = Page(gap_report_html(gap_evidence(both), album=NO_FIGURES)).texts
    assert sum("F = force tanh(s/creep_speed)" in text for text in shown) == 1


def test_the_report_has_every_figure_with_its_caption(arm: str) -> None:
    page = Page(arm)
    assert page.tags.count("img") == 6
    assert any("without assuming a law" in text for text in page.texts)


def test_numbers_stand_in_a_picture_or_in_a_table_not_in_both(arm: str) -> None:
    assert not {"8 to 16", "elbow.velocity"} & set(Page(arm).texts)
    assert "Noise is estimated from what differs between periods of the input." in Page(arm).texts
    # Stretches of time are in no bars.
    assert "0.25 to 1" in Page(arm).texts
    bare = replace(made.periodic(), where=replace(made.periodic().where, sites=()))
    shown = Page(gap_report_html(gap_evidence(replace(bare, signals=None)))).texts
    assert {"8 to 16", "elbow.velocity", "-10 to 10 mm/s"} <= set(shown)


def test_the_page_tells_its_log_and_its_maker(arm: str) -> None:
    shown = Page(arm).texts
    assert "arm.mcap: 8 s at 500 Hz" in shown
    assert f"Made by chladni {chladni.__version__}." in shown


def test_the_page_tells_how_much_of_each_log_was_used_and_which_is_shown() -> None:
    found = made.diagnosis()
    cut = replace(found.used[0], log="louder.mcap", used_s=12.5, recorded_s=20.0)
    several = replace(found, logs=("arm.mcap", "louder.mcap"), used=(*found.used, cut))
    shown = Page(gap_report_html(gap_evidence(several), album=NO_FIGURES)).texts
    told = "2 logs; arm.mcap: 8 s at 500 Hz; louder.mcap: 12.5 s of the 20 s at 500 Hz; pictures are of arm.mcap"
    assert told in shown
    unfiled = Page(gap_report_html(gap_evidence(replace(found, used=())), album=NO_FIGURES)).texts
    assert "arm.mcap: 8 s at 500 Hz" in unfiled


@pytest.mark.nightly
def test_captions_promise_nothing_where_nothing_is_named() -> None:
    told = " ".join(Page(gap_report_html(gap_evidence(made.unknown()))).texts)
    assert "with the best parameters" in told
    assert not any(words in told for words in ("what was found", "the law that was named", "the site that was named"))


def test_nothing_in_it_runs_or_is_fetched(arm: str) -> None:
    page = Page(arm)
    assert not {"script", "link", "iframe"} & set(page.tags)
    addresses = [value for name, value in page.attributes if name in ("src", "href")]
    assert addresses
    assert all(address.startswith("data:image/svg+xml;base64,") for address in addresses)


@pytest.mark.parametrize("kind", made.every_kind())
def test_every_answer_has_a_report(kind: str) -> None:
    found = made.every_kind()[kind]
    page = Page(gap_report_html(gap_evidence(replace(found, signals=None)), album=NO_FIGURES))
    assert page.open == []
    assert "Answer" in page.texts


def test_sections_without_content_are_left_out() -> None:
    found = replace(made.agreeing(), remarks=(), gap=replace(made.agreeing().gap, held_out=()))
    shown = Page(gap_report_html(gap_evidence(replace(found, signals=None)), album=NO_FIGURES)).texts
    for heading in ("Causes", "Limits", "What was weighed", "Evidence", "Linear, even, odd and noise"):
        assert heading not in shown


def test_names_and_remarks_are_text() -> None:
    cause = made.friction(site="<script>alert(1)</script>")
    found = replace(made.diagnosis(), model="<b>", causes=(cause,), remarks=("<i>x</i>",), signals=None)
    page = Page(gap_report_html(gap_evidence(found), album=NO_FIGURES))
    assert page.open == []
    assert not {"script", "b", "i"} & set(page.tags)
    assert "<i>x</i>" in page.texts


def test_the_file_is_the_page(tmp_path: Path) -> None:
    bare = gap_evidence(replace(made.diagnosis(), signals=None))
    path = write_gap_report(bare, tmp_path / "gap.html", album=NO_FIGURES)
    assert path.read_text(encoding="utf-8") == gap_report_html(bare, album=NO_FIGURES)


@pytest.mark.nightly
@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium; on Debian: apt install chromium")
def test_a_browser_shows_it_on_any_screen(arm: str, tmp_path: Path) -> None:
    playwright: Any = pytest.importorskip("playwright.sync_api")
    path = tmp_path / "gap.html"
    path.write_text(arm, encoding="utf-8")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        for width in (1200, 380):
            page = chromium.new_page(viewport={"width": width, "height": 900})
            page.goto(path.as_uri())
            assert page.evaluate("[...document.images].every(image => image.complete && image.naturalWidth > 0)")
            assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        chromium.close()
