"""Pictures of a campaign from its score."""

import pytest

from chladni.apps.campaign_pictures import campaign_album
from chladni.signals.errors import SetupError

SHARE = {"right": 8, "count": 10, "share": 0.8, "interval": [0.49, 0.94]}
NOTHING = {"right": 0, "count": 0, "share": None, "interval": [0.0, 1.0]}
SCORE = {
    "calibration": {
        "expected_error": 0.05,
        "count": 60,
        "bins": [
            {"low": 0.5, "high": 0.6, "count": 10, "probability": 0.55, "right": 0.5, "interval": [0.24, 0.76]},
            {"low": 0.9, "high": 1.0, "count": 50, "probability": 0.97, "right": 1.0, "interval": [0.93, 1.0]},
        ],
    },
    "confusion": {"lag": {"delay": 1, "lag": 5}, "delay": {"delay": 7, "unknown": 2}},
    "faint": {
        "curve": [
            {"low": 0.3, "high": 0.6, "noticed": NOTHING, "named": NOTHING},
            {"low": 0.6, "high": 1.0, "noticed": SHARE, "named": {**SHARE, "share": 0.5}},
            {"low": 1.0, "high": 1.7, "noticed": {**SHARE, "share": 1.0}, "named": SHARE},
        ]
    },
}


def test_bins_have_their_interval() -> None:
    reliability = campaign_album(SCORE).figures["calibration"].axes[0]
    (bars,) = (one for one in reliability.collections if one.get_segments())
    first, last = bars.get_segments()
    assert (first[0][1], first[1][1]) == (0.24, 0.76)
    assert (last[0][1], last[1][1]) == (0.93, 1.0)


def test_right_answers_stand_on_the_diagonal() -> None:
    (axes,) = campaign_album(SCORE).figures["confusion"].axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["lag", "delay"]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["lag", "delay", "unknown"]
    assert [(text.get_position(), text.get_text()) for text in axes.texts] == [
        ((0, 0), "5"), ((1, 0), "1"), ((1, 1), "7"), ((2, 1), "2")
    ]  # fmt: skip


def test_the_detection_curve_leaves_out_what_nobody_asked() -> None:
    (axes,) = campaign_album(SCORE).figures["detection"].axes
    noticed, named = (container.lines[0] for container in axes.containers)
    assert list(noticed.get_ydata()) == [0.8, 1.0]
    assert list(named.get_ydata()) == [0.5, 0.8]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["0.6", "1", "1.7"]


def test_a_score_of_nothing_has_no_pictures() -> None:
    bare = {"calibration": {"bins": [], "expected_error": None}, "confusion": {}, "faint": {"curve": []}}
    assert campaign_album(bare).figures == {}


def test_something_else_is_no_score() -> None:
    with pytest.raises(SetupError, match="no score of a campaign"):
        campaign_album({"format": "chladni.gap/1"})
