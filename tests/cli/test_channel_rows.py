from hypothesis import given
from hypothesis import strategies as st

from chladni.cli.channel_rows import ROWS_SHOWN_SINGLY, braced, grouped_rows


def rows_of(names, *cells):
    return [[name, *cells] for name in names]


def test_tables_that_fit_are_left_alone():
    rows = rows_of([f"/a.x[{number}]" for number in range(ROWS_SHOWN_SINGLY)], "N")
    assert grouped_rows(rows) == rows


def test_neighbours_that_differ_in_nothing_but_their_name_share_a_row():
    force = rows_of([f"/hammer.force.{axis}" for axis in "xyz"], "N", "0")
    motion = rows_of([f"/arm.linear.{axis}" for axis in "xyz"], "m/s^2", "0")
    motion[1][2] = "7"
    assert grouped_rows(force + motion, most=3) == [
        ["/hammer.force.{x, y, z}", "N", "0"],
        ["/arm.linear.x", "m/s^2", "0"],
        ["/arm.linear.y", "m/s^2", "7"],
        ["/arm.linear.z", "m/s^2", "0"],
    ]


def test_names_share_whole_parts_only():
    assert braced(["/arm.data.beams", "/arm.data.bearing"]) == "/arm.data.{beams, bearing}"
    assert braced(["/arm/level.value", "/arm/lever.value"]) == "/arm/{level, lever}.value"
    assert braced(["/arm.a", "/arm.a.b"]) == "/arm.{a, a.b}"
    assert braced(["/daq.ch1"]) == "/daq.ch1"


def test_numbered_names_are_written_as_a_span():
    assert braced([f"/a.data[{number}]" for number in range(64)]) == "/a.{data[0..63]}"
    assert braced(["/a.b[0].x", "/a.b[1].x", "/a.b[3].x", "/a.c"]) == "/a.{b[0].x, b[1].x, b[3].x, c}"
    assert braced([f"/a.b[{number}].x" for number in range(3)]) == "/a.{b[0..2]}.x"


@given(st.lists(st.text(alphabet="/.ab[]01", min_size=1, max_size=8), min_size=2, max_size=5, unique=True))
def test_every_name_can_be_read_back(names):
    text = braced(names)
    head, rest = text.split("{", 1)
    inside, tail = rest.rsplit("}", 1)
    if ".." not in inside:
        assert [f"{head}{middle}{tail}" for middle in inside.split(", ")] == names
