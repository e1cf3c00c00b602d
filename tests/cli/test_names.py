"""Names that strangers chose, through every command: nothing of them is obeyed, anywhere that they are shown."""

import base64
import csv
import json
import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from rerun.chunk import RrdReader
from scipy.signal import lfilter

from chladni.io.files.csv import write_csv
from chladni.io.files.uff import write_uff
from chladni.io.log import open_log
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from chladni.signals.visible import visible
from tests.cli.conftest import Outcome, Run
from tests.make_logs import JOINT_STATE, START_NS, LogMaker, joint_state

#: Sets the clipboard, colours, ends lines, reverses, hides, escapes by one byte, is markup, a formula, mathematics.
WILD = (
    "=cmd()\x1b]52;c;aGk=\x07\x1b[31m\nforged: 0\r\t\u202e\u2066\u200b\x9b2J\u2028\x00"
    "<script>alert(1)</script>\"'&$x_$ \\x1b ![a](http://b/c.png) --> ü 速度"
)
PLAIN = "ordinary"
RATE_HZ, SAMPLES = 200.0, 3000
FORCE = np.random.default_rng(5).standard_normal(SAMPLES)
#: Of a sampled resonator at 30 Hz, 2 % damping: peaks and a mode are told with their channels.
_POLE = np.exp((-0.02 + 1j) * 2 * np.pi * 30.0 / RATE_HZ)
MOTION = lfilter([1.0, -2.0, 1.0], [1.0, -2 * _POLE.real, abs(_POLE) ** 2], FORCE)


def write_log(folder: Path, wild: str) -> Path:
    """A log whose topics, keys, joints, frames, schemas, metadata and own name each hold `wild`."""
    path = folder / f"log {wild.replace('/', '|').replace(chr(0), '')[:60]}.mcap"
    # Pieces of chunks are others' tests: few large ones are read in a third of the time.
    with LogMaker(path, chunk_size=1 << 20) as maker:
        keys = maker.json(f"/top{wild}")
        joints = maker.ros2(f"/joints{wild}", "sensor_msgs/msg/JointState", JOINT_STATE, {wild: wild})
        bad = maker.raw(f"/bad{wild}", encoding=f"enc{wild}", schema=(f"t/msg/{wild}", f"kind{wild}", b"foo a"))
        for number, (force, motion) in enumerate(zip(FORCE.tolist(), MOTION.tolist(), strict=True)):
            time_ns = START_NS + round(number / RATE_HZ * 1e9)
            maker.write(keys, {f"force{wild}": force, f"motion{wild}": motion, wild: wild}, time_ns)
            # Two lists of names, so that elements are told apart by name.
            message = joint_state(time_ns, [wild, "b"][:: 1 if number % 2 else -1], [force, motion])
            message["header"]["frame_id"] = wild
            maker.write(joints, message, time_ns)
            maker.write(bad, b"????", time_ns)
    return path


def write_table(folder: Path, wild: str) -> Path:
    """The same names as columns of a table."""
    channels = (Channel(name=f"force{wild}", unit="N"), Channel(name=f"{wild}motion", unit="m/s^2"))
    path = folder / "table.csv"
    write_csv(TimeSeries(values=np.stack([FORCE, MOTION]), sample_rate_hz=RATE_HZ, channels=channels), path)
    return path


@pytest.fixture(scope="module", params=[write_log, write_table])
def pair(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A file with wild names, and the same with ordinary ones."""
    wild, plain = (request.param(tmp_path_factory.mktemp("names"), name) for name in (WILD, PLAIN))
    return wild, plain


@pytest.fixture(autouse=True)
def _wide(monkeypatch: pytest.MonkeyPatch) -> None:
    # Nothing is folded: every line is one that chladni means.
    monkeypatch.setenv("COLUMNS", "20000")


def require_harmless(outcome: Outcome) -> None:
    """No character of what was printed is obeyed by a terminal, nor hidden, nor begins a line of its own."""
    for text in (outcome.out, outcome.err):
        for line in text.split("\n"):
            assert visible(line) == line
            assert not line.startswith("forged")


def channels_of(path: Path) -> list[str]:
    with open_log(path) as log:
        return [channel.name for channel in log.channels]


def numbered(names: list[str], word: str) -> str:
    """The one channel whose name holds a word, as it's shown."""
    (found,) = [name for name in names if word in name]
    return visible(found)


def commands(path: Path, folder: Path) -> Iterator[tuple[object, ...]]:
    """Every command that reads a log, with channels chosen by what is shown of them."""
    names = channels_of(path)
    force, motion = numbered(names, "force"), numbered(names, "motion")
    yield "info", path
    yield "psd", path, "--csv", folder / "psd.csv"
    yield "levels", path, "--csv", folder / "l.csv", "--figures", folder
    yield "octaves", path, "--csv", folder / "octaves.csv", "--figures", folder
    yield "cepstrum", path, "--figures", folder
    yield "envelope", path, "--band", 20, 40, "--figures", folder
    yield "orders", path, "--ridge", motion, "--order", 1, "--figures", folder
    yield "ods", path, "--reference", motion, "--frequency", 30, "--figures", folder
    yield "delay", path, "--reference", force, "--response", motion, "--figures", folder
    yield "zoom", path, "--band", 10, 50, "--channel", motion, "--figures", folder
    yield "tolerance", path, "1:1", "50:1", "--unit", "1", "--channel", motion, "--figures", folder
    yield "srs", path, "--channel", motion, "--figures", folder
    yield "frf", path, "--reference", force, "--response", motion
    yield ("modes", path, "--reference", force, "--channel", motion, "--count", 1, "--csv", folder / "m.csv",
           "--report", folder / "modes.html", "--save", folder / "m.rrd", "--uff", folder / "m.uff")  # fmt: skip
    yield ("view", path, "--channel", force, "--channel", motion, "--reference", force, "--save", folder / "v.rrd",
           "--report", folder / "view.html")  # fmt: skip
    yield "compare", path, path, "--channel", motion, "--figures", folder
    for suffix in ("csv", "uff", "mat", "npz", "parquet"):
        yield "convert", path, folder / f"to.{suffix}", "--channel", force, "--channel", motion
    yield "convert", path, folder / "to.mcap", "--channel", force, "--channel", motion


@pytest.fixture(scope="module")
def written(pair: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Folders for what the commands write of either file."""
    return tmp_path_factory.mktemp("wild"), tmp_path_factory.mktemp("plain")


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("pair", [write_log, pytest.param(write_table, marks=pytest.mark.nightly)], indirect=True)
def test_every_command_prints_and_writes_harmless_names(
    run: Run, pair: tuple[Path, Path], written: tuple[Path, Path]
) -> None:
    for path, folder in zip(pair, written, strict=True):
        for command in commands(path, folder):
            # Of the ordinary names only pages are compared.
            if path == pair[0] or "--report" in command:
                outcome = run(*command)
                assert outcome.code == 0, (command[0], outcome.err)
                require_harmless(outcome)
    _require_pages(*written)
    _require_recordings(written[0])
    _require_tables(written[0])


class Structure(HTMLParser):
    """Elements of a page with the names of their attributes, and the texts between them."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, ...]] = []
        self.texts: list[str] = []
        self.pictures: list[bytes] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, *(name for name, _ in attrs)))
        if tag == "img":
            _, picture = (dict(attrs)["src"] or "").split("base64,")
            self.pictures.append(base64.b64decode(picture))

    def handle_comment(self, data: str) -> None:
        raise AssertionError(f"a name became a comment: {data}")

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def _require_pages(wild: Path, plain: Path) -> None:
    pages = sorted(path.name for path in wild.glob("*.html"))
    assert pages == ["modes.html", "view.html"]
    for name in pages:
        page, other = (Structure((folder / name).read_text()) for folder in (wild, plain))
        assert page.elements == other.elements, "no element and no attribute comes from a name"
        assert all(visible(line) == line for text in page.texts for line in text.split("\n") if "forged" in line)
        assert any("<script>alert" in text for text in page.texts), "the name itself is shown"
        # Plots hold their names as JSON, pictures as drawings.
        plots = page.elements.count(("script", "type"))
        assert len(page.pictures) + plots > 3
        for picture in page.pictures:
            tags = {element.tag.rpartition("}")[2] for element in ET.fromstring(picture).iter()}  # noqa: S314  # ours
            assert not tags & {"script", "a", "foreignObject"}


def _require_recordings(folder: Path) -> None:
    texts = [text for path in sorted(folder.glob("*.rrd")) for text in recorded(path)]
    assert any("<script>alert" in text.replace("\\", "") for text in texts)
    for text in texts:
        # A page of text has lines of its own; no name adds to them.
        assert all(visible(line) == line for line in text.split("\n"))
        assert not re.search(r"^forged", text, re.MULTILINE)
        if text.startswith("# "):
            assert not re.search(r"(?<!\\)(?:\\\\)*[<!]\w*[\[s]", text), "markup in a page is inert"


def recorded(path: Path) -> Iterator[str]:
    """Every text of a recording and its blueprint: paths of entities, names, labels, pages."""
    reader = RrdReader(path)
    stores = (*reader.recordings(), *reader.blueprints())
    for store in stores:
        yield str(store.recording_id)
        for chunk in reader.stream(store=store):
            yield chunk.entity_path
            for row in chunk.to_record_batch().to_pylist() if _holds_text(chunk) else ():
                yield from _texts(row)


def _holds_text(chunk: Any) -> bool:
    return any("string" in str(field.type) for field in chunk.to_record_batch().schema)


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        yield from (text for one in value.values() for text in _texts(one))
    elif isinstance(value, list):
        yield from (text for one in value for text in _texts(one))


def _require_tables(folder: Path) -> None:
    for path in (folder / "to.csv", folder / "m.csv"):
        lines = path.read_text(encoding="utf-8").splitlines()
        cells = [cell for row in csv.reader(lines) for cell in row]
        assert any("forged" in cell for cell in cells)
        for cell in cells:
            number = re.fullmatch(r"-?[\d.]+(e[+-]\d+)?", cell)
            assert number or not cell.startswith(("=", "+", "-", "@", "\t", "\r"))
            assert visible(cell) == cell


def test_what_is_shown_can_be_chosen(run: Run, pair: tuple[Path, Path]) -> None:
    path, _ = pair
    listed = run("info", path).out
    for name in channels_of(path):
        assert visible(name) in listed
        outcome = run("psd", path, "--channel", visible(name), "--json", "-")
        assert outcome.code == 0, outcome.err
        assert [one["name"] for one in outcome.document["channels"]] == [name]


def test_documents_hold_the_names_themselves_and_can_be_printed(run: Run, pair: tuple[Path, Path]) -> None:
    path, _ = pair
    outcome = run("info", path, "--json", "-")
    require_harmless(outcome)
    assert [one["name"] for one in outcome.document["channels"]] == channels_of(path)
    assert any(WILD in name.replace('\\"', '"').replace("\\\\", "\\") for name in channels_of(path))


def test_advice_in_a_refusal_can_be_followed(run: Run, pair: tuple[Path, Path]) -> None:
    path, _ = pair
    shown = numbered(channels_of(path), "motion")
    refused = run("psd", path, "--channel", shown.replace("motion", "motoin"))
    require_harmless(refused)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    # Of a log's path it is the field that was wrong.
    advised = shown[shown.rfind('."motion') + 1 :]
    assert re.search(rf"(did you mean|there are:) .*{re.escape(advised)}", refused.err)
    assert run("psd", path, "--channel", shown).code == 0


def test_a_setup_file_takes_what_is_shown(run: Run, pair: tuple[Path, Path], tmp_path: Path) -> None:
    path, _ = pair
    shown = numbered(channels_of(path), "motion")
    setup = tmp_path / "setup.toml"
    setup.write_text(f'format = "chladni.setup/1"\n[[channel]]\npath = {json.dumps(shown)}\nunit = "mm/s^2"\n')
    outcome = run("info", path, "--setup", setup, "--json", "-")
    assert outcome.code == 0, outcome.err
    assert [one["unit"] for one in outcome.document["channels"] if "motion" in one["name"]] == ["m/s^2"]
    setup.write_text(f'format = "chladni.setup/1"\n[[channel]]\npath = {json.dumps(shown + WILD)}\n')
    refused = run("info", path, "--setup", setup)
    require_harmless(refused)
    assert (refused.code, refused.err.count("\n")) == (2, 1)


@pytest.mark.parametrize("command", ["info", "psd", "simulate", "influence", "gap", "convert", "compare"])
def test_a_file_that_is_not_there_is_named_harmlessly(run: Run, tmp_path: Path, command: str) -> None:
    wild = tmp_path / WILD.replace("/", "|").replace("\0", "")[:100]
    more = {"gap": [wild], "compare": [wild], "convert": [tmp_path / "a.csv"], "simulate": ["--out", wild]}
    outcome = run(command, wild, *more.get(command, []))
    require_harmless(outcome)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)


def test_a_traceback_is_harmless_too(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHLADNI_TRACEBACK", "1")
    outcome = run("info", tmp_path / "a\x1b[2J\nb.mcap")
    require_harmless(outcome)
    assert "Traceback" in outcome.err


def test_no_name_forges_a_record_of_a_universal_file(tmp_path: Path) -> None:
    forging = "a\n    -1\n    -1\n    58\nforged"
    channels = (Channel(name=forging, unit="N", point="p\n    -1"), Channel(name="b", unit="N"))
    write_uff(TimeSeries(values=np.ones((2, 8)), sample_rate_hz=1.0, channels=channels), tmp_path / "a.uff")
    names = channels_of(tmp_path / "a.uff")
    assert names == [visible(forging), "b"]


def test_joints_that_are_called_by_numbers_are_read_by_their_names(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with LogMaker(path) as maker:
        joints = maker.ros2("/j", "sensor_msgs/msg/JointState", JOINT_STATE)
        for number in range(200):
            # Joint 1 comes first in every second message.
            message = joint_state(START_NS + number * 10**7, ["1", "0"][:: 1 if number % 2 else -1], [1.0, 0.0])
            message["position"] = [float(name) for name in message["name"]]
            maker.write(joints, message, START_NS + number * 10**7)
    with open_log(path) as log:
        for channel in log.channels:
            assert re.fullmatch(r'/j\.position\["[01]"\]', channel.name)
            assert (log.read([channel.name]).values == float(channel.name[-3])).all()
