"""Setup files: what they say, and that every mistake is told with its line."""

from pathlib import Path

import pytest

from chladni.io.setup import load_setup
from chladni.signals.errors import SetupError

WHOLE = """format = "chladni.setup/1"

[[point]]                       # a measurement point
name = "wrist"
position = [0.62, 0.0, 0.85]    # m

[[point]]
name = "base"
position = [0, 0, 0]

[[channel]]
path = "/imu/wrist.linear_acceleration.x"
point = "wrist"
direction = "+x"
unit = "g"
sensitivity = "100 mV/g"
range = "50 g"
role = "response"

[[channel]]
path = "/hammer.force.z"
direction = [0, 3, 4]
role = "reference"

[[line]]
points = ["base", "wrist"]

[[batch]]
topic = "/daq"
samples = ["x", "y"]
dt = "125 us"
names = ["a", "b"]
count = "n"
scale = 0.5
stamp = "last"
unit = "g"
"""


def setup_of(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "setup.toml"
    path.write_text(text, encoding="utf-8")
    return path


def mistakes(tmp_path: Path, text: str) -> list[str]:
    path = setup_of(tmp_path, text)
    with pytest.raises(SetupError) as caught:
        load_setup(path)
    lines = str(caught.value).split("\n")
    assert all(line.startswith(f"{path}:") for line in lines)
    return [line.removeprefix(f"{path}:") for line in lines]


def test_a_whole_file(tmp_path: Path) -> None:
    setup = load_setup(setup_of(tmp_path, WHOLE))
    assert setup.geometry.position("wrist") == (0.62, 0.0, 0.85)
    assert setup.geometry.lines == (("base", "wrist"),)
    wrist, hammer = setup.channels
    assert (wrist.point, wrist.direction, wrist.role, wrist.unit) == ("wrist", (1.0, 0.0, 0.0), "response", "g")
    assert wrist.overload == pytest.approx((50 * 9.80665, "m/s^2"))  # type: ignore[comparison-overlap]
    assert wrist.place.endswith("setup.toml:11")
    assert (hammer.direction, hammer.role, hammer.unit) == ((0.0, 0.6, 0.8), "reference", None)
    layout = setup.batches["/daq"]
    assert (layout.samples, layout.names, layout.count, layout.scale) == (("x", "y"), ("a", "b"), "n", 0.5)
    assert (layout.period, layout.period_unit, layout.inverse, layout.stamp) == (125e-6, 1.0, False, "last")


@pytest.mark.parametrize(
    ("line", "period", "unit", "inverse"),
    [
        ('rate = "header.rate"', "header.rate", 1.0, True),
        ('rate = "header.rate"\nrate_unit = "kHz"', "header.rate", 1000.0, True),
        ("rate = 100", 100.0, 1.0, True),
        ('rate = "25.6 kHz"', 25600.0, 1.0, True),
        ('dt = "dt"\ndt_unit = "us"', "dt", 1e-6, False),
        ("dt = 0.01", 0.01, 1.0, False),
    ],
)
def test_rates_of_batches(tmp_path: Path, line: str, period: object, unit: float, inverse: bool) -> None:
    text = f'format = "chladni.setup/1"\n[[batch]]\ntopic = "/d"\nsamples = "s"\nnames = "n"\n{line}\n'
    layout = load_setup(setup_of(tmp_path, text)).batches["/d"]
    assert (layout.period, layout.inverse) == (period, inverse)
    assert layout.period_unit == pytest.approx(unit)


def test_sensitivity_turns_volts_to_acceleration(tmp_path: Path) -> None:
    text = 'format = "chladni.setup/1"\n[[channel]]\npath = "/a.x"\nsensitivity = "100 mV/g"\n'
    (channel,) = load_setup(setup_of(tmp_path, text)).channels
    # 0.1 V is 1 g.
    factor, unit = channel.si_unit(1.0, "1")
    assert (0.1 * factor, unit) == (pytest.approx(9.80665), "m/s^2")
    factor, unit = channel.si_unit(1.0, "V")
    assert (0.1 * factor, unit) == (pytest.approx(9.80665), "m/s^2")
    with pytest.raises(SetupError, match=r"setup.toml:2: /a.x sensitivity: the log is in m/s\^2"):
        channel.si_unit(1.0, "m/s^2")


@pytest.mark.parametrize(
    ("path", "unit", "log_unit", "factor", "si_unit"),
    [
        ("/load.wrench.force.z", "lb", "N", 4.4482216152605, "N"),
        ("/scale.data", "lb", "kg", 0.45359237, "kg"),
        ("/hammer", "lb", "1", 4.4482216152605, "N"),
        ("/imu.x", "G", "m/s^2", 9.80665, "m/s^2"),
        ("/mag.x", "G", "1", 1e-4, "T"),
        ("/a.x", "ms^-2", "1", 1.0, "m/s^2"),
    ],
)
def test_a_unit_is_a_label_that_the_log_or_the_name_settles(
    tmp_path: Path, path: str, unit: str, log_unit: str, factor: float, si_unit: str
) -> None:
    (tmp_path / "setup.toml").write_text(
        f'format = "chladni.setup/1"\n[[channel]]\npath = "{path}"\nunit = "{unit}"\n'
    )
    (channel,) = load_setup(tmp_path / "setup.toml").channels
    assert channel.si_unit(1.0, log_unit) == (pytest.approx(factor, rel=1e-15), si_unit)


def test_a_unit_of_several_meanings_that_nothing_settles_is_told_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "setup.toml").write_text('format = "chladni.setup/1"\n[[channel]]\npath = "/daq.c1"\nunit = "lb"\n')
    (channel,) = load_setup(tmp_path / "setup.toml").channels
    with pytest.raises(SetupError, match=r"setup.toml:2: /daq.c1 unit: unit 'lb': it may be lbf or lbm; write which"):
        channel.si_unit(1.0, "1")
    (tmp_path / "setup.toml").write_text(
        'format = "chladni.setup/1"\n[[channel]]\npath = "/daq.c1"\nsensitivity = "50 mV/lb"\n'
    )
    with pytest.raises(SetupError, match=r"setup.toml:4: .* it may be mV/lbf or mV/lbm; write which"):
        load_setup(tmp_path / "setup.toml")


def test_millivolts_with_a_charge_free_sensitivity(tmp_path: Path) -> None:
    text = 'format = "chladni.setup/1"\n[[channel]]\npath = "/a.x"\nunit = "mV"\nsensitivity = "2 mV/N"\n'
    (channel,) = load_setup(setup_of(tmp_path, text)).channels
    factor, unit = channel.si_unit(1.0, "1")
    assert (10.0 * factor, unit) == (pytest.approx(5.0), "N")


def test_all_mistakes_at_once_each_with_its_line(tmp_path: Path) -> None:
    text = """format = "chladni.setup/1"
[[point]]
name = "wrist"
position = [0.62, 0.0, inf]

[[point]]
name = "wrist"
position = [
  1.0,
  "a",
  3.0 ]
[[channel]]
path = "/imu.x"
point = "wris"
directio = "+x"
direction = "+q"
unit = "gg"
range = 50
sensitivity = "0 mV/g"
role = "ref"
[[channel]]
path = "/imu.x"
[[line]]
points = ["wrist", "column"]
[[line]]
points = ["wrist"]
[[batch]]
topic = "/daq"
samples = "x"
rate = 3
dt = 3
"""
    found = mistakes(tmp_path, text)
    expected = [
        "4: [[point]] 1 position 3: found inf; must be finite, not inf or nan",
        "7: [[point]] 2 name: found 'wrist' a second time; one table [[point]] for each name",
        "10: [[point]] 2 position 2: found 'a'; must be a number",
        "14: [[channel]] 1 point: found 'wris', which is no point; did you mean wrist?",
        "15: [[channel]] 1 directio: unknown key; did you mean direction?",
        "16: [[channel]] 1 direction: found '+q'",
        "17: [[channel]] 1 unit: found 'gg'",
        "18: [[channel]] 1 range: found 50; must be text in quotes",
        "19: [[channel]] 1 sensitivity: found '0 mV/g'; must be greater than zero",
        "20: [[channel]] 1 role: found 'ref'; must be 'response' or 'reference'",
        "22: [[channel]] 2 path: found '/imu.x' a second time",
        "24: [[line]] 1 points 2: found 'column', which is no point",
        "26: [[line]] 2 points: found ['wrist']",
        "27: [[batch]] 1: needs either rate or dt",
    ]
    assert len(found) == len(expected)
    for line, start in zip(found, expected, strict=True):
        assert line.startswith(start)


@pytest.mark.parametrize(
    ("tail", "told"),
    [
        ('samples = "s"\nrate = 3', "needs names"),
        ('samples = ["a"]\nrate = 3\nnames = "n"', "needs names as a list"),
        ('samples = ["a"]\nrate = 3\nnames = ["n", "m"]', "has 2 names for 1 arrays"),
        ('samples = ["a"]\nrate = -3', "must be greater than zero"),
        ('samples = ["a"]\nrate = "3 s"', "must be in Hz"),
        ('samples = ["a"]\ndt = 1\ndt_unit = "m"', "must be a unit of time"),
        ('samples = ["a"]\nrate = 1\nrate_unit = "m"', "must be a unit of frequency"),
    ],
)
def test_batches_that_contradict_themselves(tmp_path: Path, tail: str, told: str) -> None:
    (line,) = {
        line.partition("; ")[2] or line
        for line in mistakes(tmp_path, f'format = "chladni.setup/1"\n[[batch]]\ntopic = "/d"\n{tail}\n')
    }
    assert told in line


def test_text_is_no_number(tmp_path: Path) -> None:
    text = 'format = "chladni.setup/1"\n[[point]]\nname = "a"\nposition = ["1", 2, 3]\n'
    assert mistakes(tmp_path, text) == ["4: [[point]] 1 position 1: found '1'; must be a number"]


def test_format_is_needed(tmp_path: Path) -> None:
    assert mistakes(tmp_path, "[[point]]\nname = 'a'\nposition = [1, 2, 3]") == [
        "1: format: is missing, and is needed"
    ]
    assert mistakes(tmp_path, 'format = "chladni.model/1"') == [
        "1: format: found 'chladni.model/1'; must be 'chladni.setup/1'"
    ]


def test_what_the_documentation_shows_is_a_setup_file(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "setup-file.md").read_text(encoding="utf-8")
    first, second = (part.partition("```")[0] for part in text.split("```toml\n")[1:])
    setup = load_setup(setup_of(tmp_path, first + second))
    assert [point.name for point in setup.geometry.points] == ["wrist", "base"]
    assert setup.batches["/daq"].names == ("ch1", "ch2")
    assert setup.batches["/daq"].period == "header.rate"
