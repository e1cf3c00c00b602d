"""Files of variants: what is read, what is refused in one line, and how a file that grows is watched."""

import itertools
import os
from pathlib import Path

import pytest

from chladni.models.core.instrument import Option
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.files.variants_file import MAX_BYTES, VariantsState, VariantsWatch, read_variants, watch_variants
from chladni.signals.errors import ModelError

PARAMETERS = Parameters(
    (
        Parameter(name="active_area", value=70e-4, unit="m^2", low=50e-4, high=80e-4, minimum=1e-6, maximum=1.0),
        Parameter(name="reduced_mass", value=300.0, unit="kg", low=100.0, high=600.0, minimum=1e-3),
    )
)
OPTIONS = (Option(name="loop", choices=("open", "position"), default="open"),)


def written(folder: Path, text: str, name: str = "rows.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def refused(path: Path) -> str:
    with pytest.raises(ModelError) as caught:
        read_variants(path, PARAMETERS, OPTIONS)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_csv_row_is_a_variant_with_units_from_the_title_or_the_cell(tmp_path: Path) -> None:
    path = written(
        tmp_path, "name,active_area [cm^2],reduced_mass,loop\nsmall,60,,open\n\nbig, 80 ,400 kg,position\n"
    )

    small, big = read_variants(path, PARAMETERS, OPTIONS)

    assert (small.name, small.options) == ("small", {"loop": "open"})
    assert small.values == {"active_area": pytest.approx(60e-4, rel=1e-15)}
    assert big.values == {"active_area": pytest.approx(80e-4, rel=1e-15), "reduced_mass": 400.0}
    assert big.options == {"loop": "position"}


def test_a_toml_table_is_a_variant(tmp_path: Path) -> None:
    first = 'format = "chladni.variants/1"\n[[variant]]\nactive_area = "60 cm^2"\n'
    text = first + '[[variant]]\nname = "b"\nreduced_mass = 2\n'

    one, second = read_variants(written(tmp_path, text, "rows.toml"), PARAMETERS, OPTIONS)

    assert (one.name, one.values) == ("variant 1", {"active_area": pytest.approx(60e-4, rel=1e-15)})
    assert (second.name, second.values) == ("b", {"reduced_mass": 2.0})


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("aktive_area\n1\n", ":1: no parameter is called 'aktive_area'; did you mean active_area?"),
        ("reduced_mass\n1_0\n", ":2: column reduced_mass: unit '_'"),
        ("reduced_mass\n\n1\x0c2\n", ":3: column reduced_mass:"),
        ("q\n1\n", ":1: no parameter is called 'q'; columns: name, active_area, reduced_mass, loop"),
        ("reduced_mass,reduced_mass\n1,2\n", ":1: column reduced_mass stands there 2 times"),
        ("reduced_mass\n1\nheavy\n", ":3: column reduced_mass:"),
        ("reduced_mass\nnan\n", ":2: column reduced_mass: found nan"),
        ("reduced_mass\n-1\n", ":2: column reduced_mass: -1 kg is not possible; give a value from 0.001 to inf"),
        ("reduced_mass\n3 m\n", ":2: column reduced_mass: found '3 m'"),
        ("reduced_mass\n1,2\n", ":2: has 2 cells, the line of titles 1"),
        ("loop\nclosed\n", ":2: column loop: found 'closed'; must be one of open, position"),
        ("name,reduced_mass\na,1\na,2\n", "2 variants are called 'a'"),
        ('reduced_mass\n"1\n', ":2: not CSV"),
    ],
)
def test_a_wrong_csv_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    assert said in refused(written(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[[variant]]\n", 'write format = "chladni.variants/1"'),
        ("= 3", ":1: not TOML"),
        (f"a = {'9' * 5000}", ":1: found a number of thousands of digits"),
        (f"a.{'b.' * 5000}c = 1", "nested too deeply"),
        ('format = "chladni.variants/1"\nvariants = 3\n', "found variants; each variant is a [[variant]] table"),
        ('format = "chladni.variants/1"\nvariant = [1]\n', "[[variant]] 1: must be a table"),
        ('format = "chladni.variants/1"\n[[variant]]\nreduced_mas = 1\n', "did you mean reduced_mass?"),
        ('format = "chladni.variants/1"\n[[variant]]\nreduced_mass = true\n', "column reduced_mass: found True"),
    ],
)
def test_a_wrong_toml_is_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    assert said in refused(written(tmp_path, text, "rows.toml"))


def test_sizes_are_bounded(tmp_path: Path) -> None:
    large = written(tmp_path, "x" * (MAX_BYTES + 1))
    assert "is larger than" in refused(large)
    many = written(tmp_path, "reduced_mass\n" + "1\n" * 1001, "many.csv")
    assert "more than 1000 variants" in refused(many)


def test_a_file_that_is_no_text_or_not_there_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    assert "no such file" in refused(path)
    path.write_bytes(b"reduced_mass\n\xff\n")
    assert ":2: byte 0xff isn't UTF-8" in refused(path)


def test_a_file_without_rows_has_no_variants(tmp_path: Path) -> None:
    assert read_variants(written(tmp_path, "reduced_mass\n"), PARAMETERS) == ()


def test_a_watched_file_gains_rows_and_a_half_written_last_line_waits(tmp_path: Path) -> None:
    path = written(tmp_path, "reduced_mass\n100\n")
    watch = VariantsWatch(path, PARAMETERS)
    assert [one.values["reduced_mass"] for one in watch.poll().variants] == [100.0]

    path.write_text("reduced_mass\n100\n20")
    # "20" may become "200": as long as its line has no end and still changes, it isn't taken.
    assert [one.values["reduced_mass"] for one in watch.poll().variants] == [100.0]

    path.write_text("reduced_mass\n100\n200\n")
    assert [one.values["reduced_mass"] for one in watch.poll().variants] == [100.0, 200.0]


def test_a_last_line_without_end_counts_once_it_rests(tmp_path: Path) -> None:
    watch = VariantsWatch(written(tmp_path, "reduced_mass\n100\n20"), PARAMETERS)

    assert [len(watch.poll().variants) for _ in range(3)] == [1, 2, 2]


def test_a_wrong_row_keeps_the_last_good_state_and_is_told_when_it_rests(tmp_path: Path) -> None:
    path = written(tmp_path, "reduced_mass\n100\n")
    watch = VariantsWatch(path, PARAMETERS)
    good = watch.poll().variants

    path.write_text("reduced_mass\n100\nheavy\n")
    assert watch.poll() == VariantsState(variants=good)
    told = watch.poll()
    assert told.variants == good
    assert "rows.csv:3: column reduced_mass" in told.mistake

    path.write_text("reduced_mass\n100\n300\n")
    assert (watch.poll().mistake, len(watch.state.variants)) == ("", 2)


def test_a_watched_file_may_come_later_and_go(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    watch = VariantsWatch(path, PARAMETERS)
    assert "no such file" in watch.poll().mistake

    written(tmp_path, "reduced_mass\n100\n")
    good = watch.poll()
    assert (len(good.variants), good.mistake) == (1, "")

    path.unlink()
    gone = watch.poll()
    assert gone.variants == good.variants
    assert "no such file" in gone.mistake


def test_watching_tells_each_state_once(tmp_path: Path) -> None:
    path = written(tmp_path, "reduced_mass\n100\n")
    looks = itertools.count()

    def go_on() -> bool:
        look = next(looks)
        if look == 3:
            path.write_text("reduced_mass\n100\n200\n")
        return look < 7

    states = list(watch_variants(path, PARAMETERS, poll_s=0.0, go_on=go_on))

    assert [len(state.variants) for state in states] == [1, 2]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_and_watched_without_waiting(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    os.mkfifo(path)
    assert "is a named pipe" in refused(path)
    assert "is a named pipe" in VariantsWatch(path, PARAMETERS).poll().mistake
