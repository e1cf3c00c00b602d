"""A large log that several share: sums of parts put together give what one reading of the whole gives."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni import Channel, TimeSeries, write_mcap
from chladni.apps import sources
from chladni.apps.shares import Gathered, NeedsWholeError, Part, right_cuts
from chladni.apps.study.steps import DOCUMENTS
from chladni.io.log import open_log
from chladni.io.study.recipe_file import FrfTable, LevelsTable, PsdTable
from chladni.io.topic import Topic
from chladni.signals.errors import EstimateError

RATE_HZ = 200.0
SAMPLES = 24_000
#: Where samples are missing, so that runs begin at no multiple of any hop.
GAPS = ((3_001, 3_150), (6_011, 6_012), (9_000, 14_321), (19_003, 19_104))
ASKED: dict[str, Any] = {
    "psd": PsdTable(resolution_hz=0.5),
    "frf": FrfTable(references=["/hammer.f"], resolution_hz=0.5, overlap=0.75),
    "levels": LevelsTable(bands_hz=[(5.0, 40.0), (60.0, 90.0)]),
}
Make = Callable[..., Path]


@pytest.fixture(scope="module")
def make(tmp_path_factory: pytest.TempPathFactory) -> Make:
    """Write a log of three channels and a slower one, with and without gaps."""

    def write(*, gaps: bool, layout: str) -> Path:
        path = tmp_path_factory.mktemp("shares") / "long.mcap"
        rng = np.random.default_rng(5)
        force = rng.standard_normal(SAMPLES)
        moved = np.convolve(force, np.exp(-np.arange(200) / 30) * np.sin(np.arange(200)))[:SAMPLES]
        values = np.stack([force, moved, 3.0 + np.sin(np.arange(SAMPLES)), np.zeros(SAMPLES)])
        valid = np.ones(values.shape, bool)
        for first, last in GAPS if gaps else ():
            valid[:, first:last] = False
        names = ("/hammer.f", "/tip.x", "/root.x", "/dead.x")
        channels = tuple(Channel(name=name, unit="N" if name == "/hammer.f" else "m/s^2") for name in names)
        series = TimeSeries(
            values=np.where(valid, values, np.nan), valid=valid, sample_rate_hz=RATE_HZ,
            start_time_ns=1_700_000_000 * 10**9, channels=channels,
        )  # fmt: skip
        write_mcap(series, path, layout=layout)
        return path

    return write


def shared(path: Path, step: str, parts: int, asked: Any = None) -> tuple[dict[str, Any], int]:
    """Do a step in parts, each on a log of its own; give the document, and how often parts were summed."""
    asked = asked or ASKED[step]
    done = [summed(path, step, Part(number=number, of=parts, step=step), asked) for number in range(parts)]
    rounds = parts
    right = {name: right_cuts([one.told[name] for one in done]) for name in done[0].told}
    for number, one in enumerate(done):
        if any(one.told[name].cuts[number : number + 2] != cuts[number : number + 2] for name, cuts in right.items()):
            done[number] = summed(path, step, Part(number=number, of=parts, step=step, cuts=right), asked)
            rounds += 1
    gathered = Gathered(step=step, sums=[one.sums for one in done], told=[one.told for one in done])
    with open_log(path) as log:
        return DOCUMENTS[step](log, asked, None, gathered), rounds


def summed(path: Path, step: str, part: Part, asked: Any) -> Part:
    with open_log(path) as log, pytest.raises(EstimateError):
        DOCUMENTS[step](log, asked, None, part)
    return part


def whole(path: Path, step: str, asked: Any = None) -> dict[str, Any]:
    with open_log(path) as log:
        return DOCUMENTS[step](log, asked or ASKED[step], None)


def agree(found: Any, expected: Any, scale: float = 0.0) -> None:
    """Demand the same document: words and counts to the byte, numbers to 1e-12 of the largest of their list.

    What is a difference of far larger numbers may be rounding alone: means and scatter are compared with the RMS,
    a skewness with 1.
    """
    if isinstance(expected, dict):
        assert found.keys() == expected.keys()
        for key in expected:
            rms = expected.get("rms", 0.0)
            agree(found[key], expected[key], {"mean": rms, "rms_std": rms, "skewness": 1.0}.get(key, 0.0))
    elif isinstance(expected, list) and expected and all(isinstance(one, float) for one in expected):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
    elif isinstance(expected, list):
        assert len(found) == len(expected)
        for one, other in zip(found, expected, strict=True):
            agree(one, other)
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-12 * scale)
    else:
        assert found == expected


@pytest.mark.parametrize("step", ASKED)
@pytest.mark.parametrize("gaps", [False, pytest.param(True, marks=pytest.mark.nightly)], ids=["whole", "gaps"])
def test_sums_of_parts_are_those_of_the_whole(make: Make, step: str, gaps: bool) -> None:
    path = make(gaps=gaps, layout="batches")
    expected = whole(path, step)
    # Of 8 parts the fourth lies in the longest gap.
    parts = 8 if gaps else 3
    found, rounds = shared(path, step, parts)
    agree(found, expected)
    # Without gaps, and where nothing hangs on where a run begins, each part is read once.
    assert (rounds > parts) == (gaps and step != "levels")


def test_a_part_decodes_its_own_messages_alone(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    path = make(gaps=False, layout="messages")
    with open_log(path) as log:
        expected = log.read(["/tip.x"]).values[:, 8_000:8_200]
    decoded, decode = [], Topic.decode

    def counted(self: Topic, batch: Any, *words: Any) -> Any:
        decoded.append(len(batch))
        return decode(self, batch, *words)

    with open_log(path) as log:
        log.grids(["/tip.x"])
        monkeypatch.setattr(Topic, "decode", counted)
        blocks = list(log.blocks(["/tip.x"], seconds=10.0, between=(8_000, 8_200)))
    assert [block.samples for block in blocks] == [200]
    np.testing.assert_array_equal(blocks[0].values, expected)
    assert 200 <= sum(decoded) < SAMPLES / 4


def test_what_is_no_sum_is_left_to_one(make: Make) -> None:
    # Whole periods are averaged from one end to the other.
    path = make(gaps=False, layout="batches")
    with open_log(path) as log, pytest.raises(NeedsWholeError):
        next(iter(Part(number=0, of=2).grids(log, None, sources.Span()))).__iter__()


def test_sums_that_dont_fit_are_refused(make: Make) -> None:
    path = make(gaps=False, layout="batches")
    done = [summed(path, "psd", Part(number=number, of=2, step="psd"), ASKED["psd"]) for number in range(2)]
    [name] = done[0].told
    broken = {**done[1].sums, f"{name}/0/products": np.zeros((3, 2))}
    gathered = Gathered(step="psd", sums=[done[0].sums, broken], told=[one.told for one in done])
    with open_log(path) as log, pytest.raises(EstimateError, match="sums of a part don't fit"):
        DOCUMENTS["psd"](log, ASKED["psd"], None, gathered)
    lacking = Gathered(step="psd", sums=[one.sums for one in done], told=[done[0].told, {}])
    with open_log(path) as log, pytest.raises(NeedsWholeError):
        DOCUMENTS["psd"](log, ASKED["psd"], None, lacking)
