"""On a log that is too short no name is believed."""

from pathlib import Path

import pytest

from chladni.apps.diagnose import diagnose_gap
from chladni.gap.diagnosis.even_odds import at_even_odds
from tests import made_diagnosis as made


def test_all_names_together_are_no_more_probable_than_none() -> None:
    found = made.diagnosis()
    doubted = at_even_odds(found)
    assert [one.probability for one in doubted.causes] == [0.5 * one.probability for one in found.causes]
    assert sum(one.probability for one in doubted.ranking) <= 0.5
    assert (doubted.verdict, doubted.gap) == (found.verdict, found.gap)


@pytest.mark.slow
@pytest.mark.parametrize("end_s", [5.05, 5.3])
def test_a_moment_of_a_measured_axis_names_nothing_for_sure(shared_data: Path, end_s: float) -> None:
    model, log = shared_data / "models" / "emps.toml", shared_data / "emps.mcap"
    found = diagnose_gap(model, log, start_s=5.0, end_s=end_s)
    assert all(cause.probability <= 0.5 for cause in found.causes)
    assert found.remarks[0].startswith("emps.mcap is short")
    assert found.used[0].warnings == found.remarks[:1]
