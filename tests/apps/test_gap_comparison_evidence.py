"""Pictures and report of a simulated log against a measured one."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.apps.gap_comparison import compare_with_simulated
from chladni.apps.gap_comparison_evidence import comparison_evidence
from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.viewers.figures.log_gap import log_gap_album
from chladni.viewers.gap_evidence import ComparisonEvidence
from chladni.viewers.report.log_gap import log_gap_report_html
from tests import made_diagnosis as made

SHORTER = 3500


@pytest.fixture(scope="module")
def evidence(tmp_path_factory: pytest.TempPathFactory) -> ComparisonEvidence:
    folder, run = tmp_path_factory.mktemp("logs"), made.nominal_run()
    theirs = np.vstack([run.inputs.values, run.outputs.values])[:, :SHORTER]
    write_mcap(made.log_series(), folder / "ours.mcap")
    write_mcap(replace(made.log_series(), values=theirs), folder / "theirs.mcap")
    with open_log(folder / "ours.mcap") as measured, open_log(folder / "theirs.mcap") as simulated:
        return comparison_evidence(compare_with_simulated(measured, simulated))


def test_signals_are_those_that_both_logs_hold(evidence: ComparisonEvidence) -> None:
    np.testing.assert_allclose(evidence.signals.measured, made.measured()[:, :SHORTER], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(
        evidence.signals.before, made.nominal_run().outputs.values[:, :SHORTER], rtol=1e-6, atol=1e-6
    )


def test_there_is_one_simulation_in_every_figure(evidence: ComparisonEvidence) -> None:
    figures = log_gap_album(evidence, prefix="1 ").figures
    assert set(figures) == {"1 signals", "1 errors", "1 spectra", "1 gap map"}
    first, last = (round(end * made.RATE_HZ) for end in evidence.telling_s)
    for row, axes in enumerate(figures["1 signals"].axes):
        assert [line.get_label() for line in axes.lines] == ["measured", "simulated"]
        np.testing.assert_array_equal(axes.lines[1].get_ydata(), evidence.signals.before[row, first:last])
    assert [line.get_label() for line in figures["1 spectra"].axes[0].lines] == ["measured", "error", "noise"]
    assert len(figures["1 errors"].axes[0].lines) == 1
    # The map and its scale of colours.
    assert len(figures["1 gap map"].axes) == 2


def test_the_report_holds_what_the_terminal_says(evidence: ComparisonEvidence) -> None:
    odd = replace(evidence, simulated="<b>theirs</b>")
    album = log_gap_album(evidence)
    page = log_gap_report_html([(odd, album)], levels=("the gap grows",), interactive=False)
    for words in (*evidence.answer, "Limits", "the gap grows", "&lt;b&gt;theirs", evidence.where.channels[0].name):
        assert words.replace("'", "&#x27;") in page
    assert "<b>" not in page
    assert page.count("<figure") == len(album.figures)
