"""``chladni modes`` on a log whose modes are known, and on measured ones."""

import numpy as np
import pytest

from chladni.cli.main import main
from tests.arm import FORCE, TOOL, short_arm
from tests.impact_file import write_functions
from tests.io.files.uff_makers import response_set
from tests.modal.truth import chain, mac

KEYS = {"frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std", "mpc", "shape", "relative_motion"}


@pytest.fixture(scope="module")
def truth():
    return short_arm().modes


@pytest.fixture(scope="module")
def arm_functions(arm_log, tmp_path_factory):
    """A universal file of the log's functions and modes."""
    path = tmp_path_factory.mktemp("functions") / "arm.uff"
    assert main(["modes", str(arm_log), "--setup", str(arm_log.with_name("setup.toml")), "--uff", str(path)]) == 0
    return path


def test_the_document_holds_the_true_modes_within_their_error_bars(run, arm_log, truth):
    setup = arm_log.with_name("setup.toml")
    document = run("modes", arm_log, "--setup", setup, "--json", "-").document
    assert document["format"] == "chladni.modes/1"
    assert 0 < document["fit_error"] < 0.2
    found = document["modes"]
    assert all(set(mode) >= KEYS for mode in found)
    for key, std, true in (
        ("frequency_hz", "frequency_std_hz", truth.frequency_hz),
        ("damping_ratio", "damping_std", truth.damping_ratio),
    ):
        off = [(mode[key] - one) / mode[std] for mode, one in zip(found, true, strict=True)]
        assert np.abs(off).max() < 4
    for mode, shape in zip(found, truth.shapes, strict=True):
        vector = np.array([entry["real"] + 1j * entry["imag"] for entry in mode["shape"]])
        mac = abs(np.vdot(vector, shape)) ** 2 / (np.vdot(vector, vector) * np.vdot(shape, shape)).real
        # The mode at 98 Hz hardly moves the tool that is shaken: its own error bars allow no more.
        assert mac > 0.99
        assert {tuple(pair["between"]) for pair in mode["relative_motion"]} >= {("base", "column")}
    # From the column to the base, in the first mode: how much less the base moves.
    first = next(step for step in document["transmissibility"] if step["between"] == ["base", "column"])
    exact = abs(truth.shapes[first["mode"], 1] / truth.shapes[first["mode"], 0])
    assert first["ratio"] == pytest.approx(exact, abs=4 * first["ratio_std"])


def test_people_get_a_table_with_error_bars_and_advice(run, arm_log):
    outcome = run("modes", arm_log, "--setup", arm_log.with_name("setup.toml"), "--reference", FORCE)
    assert outcome.code == 0, outcome.err
    assert "5 modes" in outcome.out
    assert "±" in outcome.out
    assert "modal mass" in outcome.out
    assert "base - column" in outcome.out or "column - arm" in outcome.out
    assert "driving point" in outcome.out


@pytest.mark.nightly
@pytest.mark.slow
def test_band_count_and_frequency_choose(run, arm_log, truth):
    def frequencies(*options):
        document = run("modes", arm_log, "--reference", FORCE, *options, "--json", "-").document
        return [mode["frequency_hz"] for mode in document["modes"]]

    assert frequencies("--band", 15, 57) == pytest.approx(truth.frequency_hz[:2], rel=0.01)
    assert len(frequencies("--count", 2)) == 2
    assert frequencies("--frequency", 170) == pytest.approx(truth.frequency_hz[-1:], rel=0.01)


@pytest.mark.parametrize(
    "method",
    [
        "half-power",
        "fdd",
        *(pytest.param(one, marks=pytest.mark.nightly) for one in ("circle-fit", "efdd", "ssi-cov")),
    ],
)
def test_other_methods(run, arm_log, truth, method):
    document = run("modes", arm_log, "--method", method, "--band", 5, 280, "--json", "-").document
    found = np.array([mode["frequency_hz"] for mode in document["modes"]])
    assert found.size >= 2
    assert np.all(np.abs(found[:, None] / truth.frequency_hz - 1).min(axis=1) < 0.03)


@pytest.mark.nightly
@pytest.mark.slow
def test_files_are_written(run, arm_log, tmp_path):
    paths = {name: tmp_path / f"modes.{name}" for name in ("uff", "csv", "rrd", "html")}
    outcome = run(
        "modes", arm_log, "--setup", arm_log.with_name("setup.toml"), "--uff", paths["uff"], "--csv", paths["csv"],
        "--save", paths["rrd"], "--report", paths["html"], "--figures", tmp_path / "figures",
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    for path in paths.values():
        assert path.stat().st_size > 500
        assert str(path) in outcome.out.replace("\n", "")
    assert (tmp_path / "figures" / "stabilisation.png").exists()


def test_no_mode_is_an_answer_with_its_reason(run, arm_log):
    outcome = run("modes", arm_log, "--reference", FORCE, "--channel", TOOL, "--band", 200, 290)
    assert outcome.code == 0, outcome.err
    assert "No mode was found." in outcome.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--reference", FORCE, "--operational"], "drop one of them"),
        (["--reference", FORCE, "--method", "fdd"], "method fdd uses responses alone"),
        (["--operational", "--method", "plscf"], "method plscf needs an excitation"),
        (["--operational", "--resolution", 0.5], "resolution of 0.5 Hz says nothing"),
        (["--reference", "/nowhere"], "/nowhere"),
        (["--band", 400, 450], "arm.mcap: band 400 to 450 Hz"),
        (["--operational", "--start", 0, "--end", 0.1], "arm.mcap: 100 samples"),
        (["--count", 0], "count"),
        (["--method", "magic"], "'magic'"),
        (["--channel", "/base.accel.linear.q", "--operational"], "/base.accel.linear.q"),
    ],
)
def test_bad_options_are_told_in_one_line(run, arm_log, arguments, words):
    outcome = run("modes", arm_log, *arguments)
    assert outcome.code == 2
    assert words in outcome.err
    assert outcome.err.count("\n") == 1


def test_a_universal_file_gives_the_modes_of_its_functions(run, arm_functions, truth):
    document = run("modes", arm_functions, "--json", "-").document
    found = [mode["frequency_hz"] for mode in document["modes"]]
    assert found == pytest.approx(truth.frequency_hz, rel=1e-3)


def test_a_universal_file_without_functions_shows_the_modes_that_it_holds(run, arm_log, tmp_path, truth):
    from chladni.io.files.uff_modes import write_uff_modes
    from chladni.io.log import open_log

    with open_log(arm_log, setup=arm_log.with_name("setup.toml")) as log:
        import chladni

        modes = chladni.identify_modes(log)
        write_uff_modes(tmp_path / "shapes.uff", modes, geometry=log.geometry)
    outcome = run("modes", tmp_path / "shapes.uff")
    assert outcome.code == 0, outcome.err
    assert "those that the file holds" in " ".join(outcome.out.split())
    assert "5 modes" in outcome.out


def accelerance(frequency_hz):
    """One degree of freedom of 3 kg, 12 Hz and 1 %: -r^2 over m (1 - r^2 + 2 j zeta r)."""
    ratio = frequency_hz / 12.0
    return -(ratio**2) / (3.0 * (1 - ratio**2 + 0.02j * ratio))


def test_functions_of_a_universal_file_without_unit_give_frequencies_and_take_a_setup_file(run, tmp_path):
    values = accelerance(0.25 * np.arange(200))
    path = tmp_path / "function.uff"
    path.write_bytes(response_set(values, step=0.25, type=0, below_type=0, label="NONE"))
    bare = run("modes", path, "--json", "-")
    assert bare.code == 0, bare.err
    (mode,) = bare.document["modes"]
    assert mode["frequency_hz"] == pytest.approx(12.0, rel=1e-9)
    assert mode["damping_ratio"] == pytest.approx(0.01, rel=1e-6)
    setup = tmp_path / "setup.toml"
    tables = [("1:+3", "m/s^2"), ("1:+3 (reference)", "N")]
    setup.write_text(
        'format = "chladni.setup/1"\n'
        + "".join(f'[[channel]]\npath = "{name}"\nunit = "{unit}"\n' for name, unit in tables)
    )
    told = run("modes", path, "--setup", setup)
    assert told.code == 0, told.err
    assert "modal mass [kg]" in told.out
    row = next(line for line in told.out.splitlines() if line.startswith("1 ") and "±" in line)
    # The last column is the modal mass with its error.
    assert float(row.split()[-3]) == pytest.approx(3.0, rel=1e-3)


def test_one_function_without_unit_costs_no_other(run, tmp_path):
    values = accelerance(0.25 * np.arange(200))
    path = tmp_path / "functions.uff"
    path.write_bytes(response_set(values, step=0.25) + response_set(values, step=0.25, node=2, label="EU"))
    outcome = run("modes", path)
    assert outcome.code == 0, outcome.err
    told = " ".join(outcome.out.split())
    assert "left out: 2:+3 without unit" in told
    assert "whatever unit the sensor was set up in" in told


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (["--operational"], "responses and 5 modes, but no samples over time; chladni frf arm.uff shows them"),
        (["--start", 0], "arm.uff: holds averaged functions already; leave out resolution"),
        (["--resolution", 0], "arm.uff: holds averaged functions already; leave out resolution"),
        (["--stamp", "log"], "stamp 'log' (--stamp) chooses among the times of messages"),
        (["--reference", "/x.y"], "no reference '/x.y'; there are: /shaker"),
    ],
)
def test_options_of_samples_are_refused_for_functions(run, arm_functions, option, words):
    outcome = run("modes", arm_functions, *option)
    assert outcome.code == 2
    assert words in outcome.err


@pytest.mark.parametrize("damping", [1e-3, 2e-4])
def test_a_file_of_resonances_narrower_than_its_lines_has_them_all(run, tmp_path, damping):
    lines_hz, structure = np.arange(0.0, 400.0), chain(first_hz=51.3, damping=damping)
    functions = structure.accelerance(lines_hz, (0,))
    path = write_functions(tmp_path / "narrow.uff", functions, lines_hz, responses=range(1, 6), references=[1])
    document = run("modes", path, "--json", "-").document
    assert [mode["frequency_hz"] for mode in document["modes"]] == pytest.approx(structure.frequency_hz, rel=1e-6)
    assert [mode["damping_ratio"] for mode in document["modes"]] == pytest.approx([damping] * 5, rel=1e-3)
    told = " ".join(run("modes", path).out.split())
    assert "take power in" in told
    assert "average longer" not in told


@pytest.mark.parametrize("fixed", [0, 4])
def test_a_roving_hammer_gives_shapes_over_the_points_it_hit(run, tmp_path, fixed):
    lines_hz, structure = np.arange(0.0, 8.0, 0.02), chain()
    functions = structure.accelerance(lines_hz, range(5))[fixed : fixed + 1]
    path = write_functions(tmp_path / "rove.uff", functions, lines_hz, responses=[fixed + 1], references=range(1, 6))
    document = run("modes", path, "--json", "-").document
    for mode, shape in zip(document["modes"], structure.shapes, strict=True):
        assert [entry["point"] for entry in mode["shape"]] == ["1", "2", "3", "4", "5"]
        found = np.array([entry["real"] + 1j * entry["imag"] for entry in mode["shape"]])
        assert mac(found, shape) == pytest.approx(1, abs=1e-6)
        assert mode["mpc"] == pytest.approx(1, abs=1e-6)
        # Unit mass: 1/phi_max^2 kg.
        assert mode["modal_mass"] == pytest.approx(1 / np.abs(shape).max() ** 2, rel=1e-3)
    assert document["references"] == [f"{fixed + 1}:+3 (reference)"]
    assert any("5 hit points taken as responses" in note for note in document["notes"])


def test_modes_of_one_channel_have_no_phase_collinearity(run, tmp_path):
    lines_hz = np.arange(0.0, 8.0, 0.02)
    functions = chain().accelerance(lines_hz, (0,))[:1]
    path = write_functions(tmp_path / "one.uff", functions, lines_hz, responses=[1], references=[1])
    outcome = run("modes", path, "--json", "-")
    modes = outcome.document["modes"]
    assert len(modes) == 5
    assert [(mode["mpc"], mode["mpd_deg"], mode["mean_phase_deg"]) for mode in modes] == [(None, None, None)] * 5
    assert "1.000" not in run("modes", path).out
