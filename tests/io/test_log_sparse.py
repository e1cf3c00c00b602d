"""Stamps far apart: what is laid out is bounded by what the log holds, and the advice reads the rest."""

import re
import tracemalloc
from collections.abc import Sequence
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chladni.apps.sources import Span, watched_grids
from chladni.io import log_reader, source
from chladni.io.clock.clock_count import SHORT
from chladni.io.log import open_log
from chladni.io.log_reader import MostlyEmptyError
from tests.make_logs import START_NS, LogMaker

PERIOD_NS = 1_000_000
HOUR_NS = 3600 * 10**9
FEW_VALUES = 1 << 18


def write_bursts(path: Path, bursts: Sequence[tuple[int, int]], *, fields: int = 1, topics: int = 1) -> None:
    """Bursts of (start in ns, messages) at 1 kHz, on each topic; the values count the messages."""
    with LogMaker(path) as maker:
        channels = [maker.json(f"/t{number}") for number in range(topics)]
        count = 0
        for start_ns, messages in bursts:
            for place in range(messages):
                payload = {f"f{field}": float(count) for field in range(fields)}
                for channel in channels:
                    maker.write(channel, payload, START_NS + start_ns + place * PERIOD_NS)
                count += 1


def refusal(path: Path) -> str:
    with open_log(path) as log, pytest.raises(MostlyEmptyError) as caught:
        log.read_groups()
    return str(caught.value)


@pytest.mark.parametrize(("fields", "topics"), [(1, 1), (300, 1), (20, 5), (1, 40)])
def test_few_messages_hours_later_are_refused_before_memory_is_taken(
    tmp_path: Path, fields: int, topics: int
) -> None:
    path = tmp_path / "a.mcap"
    write_bursts(path, [(0, 50), (100 * HOUR_NS, 2)], fields=fields, topics=topics)
    tracemalloc.start()
    told = refusal(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 64 << 20
    assert told.startswith("a.mcap: /t0: 2 of 52 messages lie 360000 s after the others, so ")
    assert f"values would be laid out for {52 * fields * topics} samples" in told
    assert "--stamp log" not in told, "these are the log's own times already"


def test_values_count_and_not_places(tmp_path: Path) -> None:
    """A grid that one channel may have is too much for three hundred."""
    bursts = [(0, 50), (HOUR_NS, 2)]
    write_bursts(tmp_path / "one.mcap", bursts)
    with open_log(tmp_path / "one.mcap") as log:
        assert log.read().samples == 3_600_002
    write_bursts(tmp_path / "many.mcap", bursts, fields=300)
    assert "1080000600 values would be laid out for 15600 samples" in refusal(tmp_path / "many.mcap")
    with open_log(tmp_path / "many.mcap") as log:
        assert log.read(["/t0.f7"]).samples == 3_600_002, "fewer channels are read"


def test_all_topics_count_together(tmp_path: Path) -> None:
    """Grids of different rates are laid out side by side."""
    with LogMaker(tmp_path / "a.mcap") as maker:
        for number in range(8):
            channel = maker.json(f"/t{number}")
            for place in [*range(100), 3_000_000]:
                maker.write(channel, {"x": 1.5}, START_NS + place * (PERIOD_NS + 100_000 * number))
    with open_log(tmp_path / "a.mcap") as log:
        assert log.read_groups([f"/t{number}.x" for number in range(4)])
        with pytest.raises(MostlyEmptyError, match="values would be laid out for 808 samples"):
            log.read_groups()


# Fewer than SHORT messages between pauses are events, which have no grid.
@pytest.mark.nightly
@given(
    bursts=st.lists(
        st.tuples(st.integers(100, 20 * HOUR_NS // PERIOD_NS), st.integers(SHORT, 60)),
        min_size=1,
        max_size=5,
    ),
    fields=st.sampled_from([1, 7, 60]),
)
@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_what_is_laid_out_is_bounded_and_the_advice_reads_all(
    tmp_path: Path, bursts: list[tuple[int, int]], fields: int
) -> None:
    """Bursts of (pause before it in periods, messages)."""
    path = tmp_path / "a.mcap"
    starts, start = [], 0
    for pause, messages in bursts:
        starts.append(((start + pause) * PERIOD_NS, messages))
        start += pause + messages
    write_bursts(path, starts, fields=fields)
    held = fields * sum(messages for _, messages in starts)
    tracemalloc.start()
    with patch.object(log_reader, "EMPTY_VALUES", FEW_VALUES):
        found = sorted(read_by_advice(path, None, None))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # Values, a flag for each and what making the flags takes, and a reader.
    assert peak < 24 * (FEW_VALUES + log_reader.SPARSE_IN_MEMORY * held) + (8 << 20)
    assert found == list(range(sum(messages for _, messages in starts)))


def read_by_advice(path: Path, start_s: float | None, end_s: float | None) -> list[int]:
    """Read as much as is refused in the parts that the refusal names."""
    with open_log(path) as log:
        try:
            groups = log.read_groups(start_s=start_s, end_s=end_s)
        except MostlyEmptyError as error:
            cut = re.search(r"\(--end (\S+)\) or after \(--start \1\)", str(error))
        else:
            return [int(value) for one in groups for value in one.values[0] if np.isfinite(value)]
    assert cut is not None
    cut_s = float(cut[1])
    return read_by_advice(path, start_s, cut_s) + read_by_advice(path, cut_s, end_s)


def test_a_spectrum_of_what_is_too_empty_for_memory_goes_block_by_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(log_reader, "EMPTY_VALUES", FEW_VALUES)
    monkeypatch.setattr(source, "VALUES_IN_A_BLOCK", FEW_VALUES)
    path = tmp_path / "a.mcap"
    write_bursts(path, [(number * 20 * 10**9, 400) for number in range(8)], fields=10)
    with open_log(path) as log:
        with pytest.raises(MostlyEmptyError):
            log.read_groups()
        (watched,) = watched_grids(log, None, Span())
        blocks = list(watched)
    assert len(blocks) > 1
    assert sum(int(np.isfinite(block.values[0]).sum()) for block in blocks) == 3200


def test_a_log_of_one_stretch_has_no_bound(tmp_path: Path) -> None:
    write_bursts(tmp_path / "a.mcap", [(0, 300)], fields=100)
    with open_log(tmp_path / "a.mcap") as log:
        assert log.read().values.shape == (100, 300)


def test_a_flipped_bit_of_one_stamp_costs_neither_memory_nor_the_rest(tmp_path: Path) -> None:
    write_bursts(tmp_path / "a.mcap", [(0, 276), (1 << 55, 1)], fields=9)
    with open_log(tmp_path / "a.mcap") as log:
        assert log.read().samples == 276
