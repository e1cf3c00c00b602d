"""Tables as they are printed."""

from chladni.cli.output import MOST_ROWS, Output


def test_a_table_of_too_many_rows_ends_with_a_word(capsys):
    Output().table("Levels", ["channel"], [[f"/c{number}.x"] for number in range(MOST_ROWS + 7)])
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if line.startswith("/c")][-1].strip() == f"/c{MOST_ROWS - 1}.x"
    assert lines[-1] == "... and 7 more rows; --json FILE holds all of them"
    Output().table("Levels", ["channel"], [[f"/c{number}.x"] for number in range(MOST_ROWS)])
    assert "more" not in capsys.readouterr().out
