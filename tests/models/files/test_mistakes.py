"""Every mistake of a model file is told with its line, its key, what was found and what would be right."""

from pathlib import Path

import pytest

from chladni.models.files.model_file import load_model
from chladni.signals.errors import ModelError
from tests.models.files.made_files import DRIVE, SCHEME, STRUCTURE, written


def told(folder: Path, text: str) -> list[str]:
    """Lines of the error, with a short name of the file."""
    path = written(folder, text)
    with pytest.raises(ModelError) as caught:
        load_model(path)
    return str(caught.value).replace(str(path), "m.toml").split("\n")


def line_of(text: str, part: str) -> int:
    """Number of the line in which `part` begins."""
    return text[: text.index(part)].count("\n") + 1


# (what stands there, what stands there instead, what is told). `@` marks the place of the line that is named.
STRUCTURE_MISTAKES = [
    ('format = "chladni.model/1"', '@format = "chladni.model/2"', "format: found 'chladni.model/2'; must be"),
    ('name = "arm"', "", "name: is missing, and is needed"),
    ('name = "arm"', '@name = "arm\\u001b[2J"', "name: found 'arm\\x1b[2J'; must be text without line feeds"),
    ('kind = "structure"', '@kind = "structures"', "kind: found 'structures'; must be 'structure', 'drive' or"),
    ('kind = "structure"', "", "kind: is missing, and is needed"),
    ('name = "shoulder"', '@name = "column"', "[[joint]] 1 name: the name 'column' is taken by a body"),
    ('name = "hammer"', '@name = "ground"', "[[input]] 1 name: the name 'ground' is reserved"),
    ('name = "pull"', '@name = "1st"', "[[output]] 3 name: found '1st'; names begin with a letter"),
    ('name = "pull"', "@name = 3", "[[output]] 3 name: found 3; must be text in quotes"),
    ('name = "pull"', '@name = "hammer"', "[[output]] 3 name: the name 'hammer' is taken by an input"),
    ("mass = 2.5", "@mas = 2.5", "[[body]] 2 mas: unknown key; did you mean mass?"),
    ("mass = 2.5", "@mass = nan", "[[body]] 2 mass: found nan; must be finite"),
    ("mass = 2.5", "@mass = inf", "[[body]] 2 mass: found inf; must be finite"),
    ("mass = 2.5", "@mass = 1" + "0" * 400, "must be finite, and within double precision"),
    ("mass = 2.5", "@mass = true", "[[body]] 2 mass: found True; must be a number"),
    ("mass = 2.5", "@mass = -2.5", "[[body]] 2 mass: body 'wrist': mass -2.5 kg must be finite and positive"),
    ("mass = 2.5", '@mass = "3 N"', "[[body]] 2 mass: found '3 N', which is in N; must be a number in kg"),
    ("mass = 2.5", '@mass = "heavy"', "[[body]] 2 mass: quantity 'heavy': begins with no finite number"),
    ("mass = 2.5", '@mass = "3 zz"', "[[body]] 2 mass: unit 'zz': not known"),
    ("mass = 2.5", "mass = 2.5\ninertia = 1.0", "[[body]] 2: needs a mass in kg, or an inertia"),
    ('[0.0, 0.0, "400 mm"]', "@[0.0, 0.0]", "[[body]] 1 position 3: is missing"),
    ('[0.0, 0.0, "400 mm"]', '@[0.0, 0.0, "400 N"]', "found '400 N', which is in N; must be a number in m"),
    ('[0.0, 0.0, "400 mm"]', "@0.4", "[[body]] 1 position: found 0.4; must be a list in brackets"),
    ('["column", "wrist"]', '@["column", "wrst"]', "'wrst' is no body; did you mean 'wrist'?"),
    ('["column", "wrist"]', '@["column", "column"]', "both ends are 'column'"),
    ('["column", "wrist"]', '@["column"]', "[[joint]] 2 between 2: is missing"),
    ('"0.6 kN/mm"', '@"3 kg"', "[[joint]] 2 stiffness: found '3 kg', which is in kg; must be a number in N/m"),
    ('"0.6 kN/mm"', "@-1.0", "[[joint]] 2 stiffness: found -1.0; must be 0 or more"),
    ('"0.6 kN/mm"', "@1e300", "[[joint]] 2 stiffness: found 1e+300 N/m is too large to work with; give a size from"),
    ("damping = 90\n", "", "[[joint]] 2 damping: is missing, and is needed"),
    ('at = "wrist"\nchannel = "/hammer', '@at = "wirst"\nchannel = "/hammer', "'wirst' is no body or joint; did you"),
    ('at = "wrist"\nchannel = "/hammer', '@at = "ground"\nchannel = "/hammer', "use kind base_acceleration"),
    ('at = "wrist"\nchannel = "/hammer', '@at = "elbow"\nchannel = "/hammer', 'is a joint; write joint = "elbow"'),
    ('name = "motor"\njoint = "elbow"', 'name = "motor"', "[[input]] 2: needs at (a body), or joint"),
    ('name = "motor"\njoint', 'name = "motor"\nat = "wrist"\njoint', "[[input]] 2: has both at and joint"),
    ('name = "motor"\njoint = "elbow"', 'name = "motor"\n@joint = "elbo"', "'elbo' is no joint; did you mean elbow?"),
    ('kind = "base_acceleration"', '@kind = "base"', "[[input]] 3 kind: found 'base'; must be 'force'"),
    ('kind = "base_acceleration"', 'kind = "base_acceleration"\n@at = "wrist"', "base_acceleration acts at"),
    ('kind = "base_acceleration"', 'kind = "displacement"\n@at = "elbow"', "'elbow' is a joint"),
    ('kind = "base_acceleration"', 'kind = "displacement"\n@at = "gone"', "'gone' is no body; there are: column"),
    ('kind = "base_acceleration"', 'kind = "displacement"\nat = "wrist"', "a force at 'wrist' does nothing"),
    ('kind = "disturbance"\nat = "axis"', 'kind = "disturbance"\n@at = "axes"', "'axes' is no controller; did you"),
    ('measures = "force"', '@measures = "power"', "[[output]] 3 measures: found 'power'; must be 'acceleration'"),
    ('measures = "force"\njoint = "elbow"', 'measures = "force"\n@at = "wrist"', "'wrist' is no joint; there are"),
    ('measures = "acceleration"\nat = "wrist"', 'measures = "acceleration"\n@at = "ground"', "'ground' doesn't move"),
    ('measures = "acceleration"\nat = "wrist"', 'measures = "acceleration"\n@at = "w"', "'w' is no body or joint"),
    ('channel = "/wrist.accel.linear.x"', '@channel = "/hammer.wrench.force.x"', "is that of 'hammer' already"),
    ('feedback = "bend"', '@feedback = "bnd"', "[[controller]] 1 feedback: 'bnd' is no output; did you mean 'bend'?"),
    ('drives = "motor"', '@drives = "motr"', "[[controller]] 1 drives: 'motr' is no input; did you mean 'motor'?"),
    ('drives = "motor"', '@drives = "floor"', "'floor' is no force; a controller drives an input of kind force"),
    ('drives = "motor"', "", "[[controller]] 1 drives: is missing, and is needed"),
    ('law = "pd"', '@law = "pdx"', "[[controller]] 1 law: found 'pdx'; must be 'p', 'pd'"),
    ('law = "pd"\n', "", "[[controller]] 1: law is missing, and is needed: p, pd, pi, pid, p-p"),
    ('law = "pd"', 'law = "pi"', "[[controller]] 1 gains kd: unknown gain; gains: kp, ki"),
    ("kd = 3.0", "filter = 0.1", "[[controller]] 1: controller 'axis': gain kd is missing; law pd has gains kp, kd"),
    ('"20 V/mm"', '"20 V"', "[[controller]] 1 gains kp: found '20 V', which is in V; must be a number in V/m"),
    ('gain = "35.15 N/V"', "@gain = [1]", "[[controller]] 1 gain: found [1]; must be a number"),
    ('gain = "35.15 N/V"', '@gain = "0 N/V"', "[[controller]] 1 gain: found '0 N/V'; a gain of zero drives nothing"),
    ('limit = "10 V"', '@limit = "10 kg"', "[[controller]] 1 limit: found '10 kg', which is in kg; must be"),
    ('limit = "10 V"', '@limit = "-10 V"', "[[controller]] 1 limit: found '-10 V'; must be above zero"),
    ('limit = "10 V"', '@limit = "10 zz"', "[[controller]] 1 limit: unit 'zz': not known"),
    ('law = "pd"', 'law = "pd"\n@num = 1', "[[controller]] 1 num: found 1; must be a list in brackets"),
    ('law = "pd"', 'law = "pd"\nnum = [1]', "[[controller]] 1: controller 'axis': law pd has no num and den"),
    ("gains = { kp = \"20 V/mm\", kd = 3.0 }", "gains = 3", "[[controller]] 1 gains: found 3; must be a table"),
    ('effect = "coulomb_friction"', '@effect = "coulomb"', "no effect 'coulomb'; did you mean coulomb_friction?"),
    ('site = "elbow"', '@site = "elbo"', "[[effect]] 1 site: no site 'elbo'; did you mean elbow?"),
    ('site = "elbow"', 'site = "wrist"', "[[effect]] 1: coulomb_friction acts at a joint, but 'wrist' is a body"),
    ("{ force = 8.1 }", "{ forc = 8.1 }", "[[effect]] 1 parameters forc: unknown parameter; did you mean force?"),
    ("{ force = 8.1 }", "{ }", "[[effect]] 1: coulomb_friction at 'elbow': give force [N]"),
    ("{ force = 8.1 }", '{ force = "8 m" }', "parameters force: found '8 m', which is in m; must be a number in N"),
    ("{ force = 8.1 }", "{ force = nan }", "[[effect]] 1 parameters force: found nan; must be finite"),
    ('variant = "share"', '@variant = "shar"', "[[effect]] 2 variant: cross_axis: no variant 'shar'; did you"),
    (', from = "bend"', "", "[[effect]] 2: cross_axis at 'acc_wrist': name the output"),
    ('from = "bend"', 'from = "bnd"', "[[effect]] 2: cross_axis at 'acc_wrist': no output 'bnd'"),
    ('"elbow.stiffness" = 0.2', '@"elbow.stiffnss" = 0.2', "'elbow.stiffnss'; did you mean elbow.stiffness?"),
    ('"elbow.stiffness" = 0.2', '@"" = 0.2', "no parameter ''; parameters: "),
    ('"elbow.stiffness" = 0.2', '@"".elbow.stiffness = 0.2', "no parameter '.elbow.stiffness'; did you mean"),
    ('"elbow.stiffness" = 0.2', '@elbow."" = 0.2', "no parameter 'elbow.'; "),
    ('"elbow.stiffness" = 0.2', '@"elbow.stiffness" = -0.2', "found -0.2; must be 0 or more"),
    ('"elbow.stiffness" = 0.2', '@"elbow.stiffness" = inf', "found inf; must be finite"),
    ('"elbow.stiffness" = 0.2', '@"elbow.stiffness" = true', "found True; must be a number: one sigma"),
    ('"elbow.stiffness" = 0.2', '@"elbow.stiffness" = "3 N"', "found '3 N', which is in N; must be a plain number"),
    ("default = 0.1", "@default = [0.1]", "found [0.1]; must be a number: one sigma over the value"),
    ("[tolerance]", "[tolerances]", "tolerances: unknown key; did you mean tolerance?"),
]  # fmt: skip


@pytest.mark.parametrize(("there", "instead", "words"), STRUCTURE_MISTAKES)
def test_a_mistake_in_a_structure(tmp_path: Path, there: str, instead: str, words: str) -> None:
    assert STRUCTURE.count(there) == 1
    text = STRUCTURE.replace(there, instead)
    lines = told(tmp_path, text.replace("@", ""))
    matching = [line for line in lines if words in line]
    assert matching, lines
    if "@" in text:
        assert matching[0].startswith(f"m.toml:{line_of(text, '@')}: "), matching
    # One slip makes one line; only a name that others refer to by makes more.
    assert len(lines) <= 2, lines


DRIVE_MISTAKES = [
    ('drive = "pneumatic-motor"', '@drive = "pneumatic"', "no drive 'pneumatic'; did you mean pneumatic-motor?"),
    ('drive = "pneumatic-motor"', "", "drive: is missing, and is needed"),
    ('end_stops = "on"', '@end_stops = "yes"', "option end_stops = 'yes'; choose one of off, on"),
    ('end_stops = "on"', '@endstops = "on"', "no option 'endstops'; options: end_stops"),
    ('end_stops = "on"', "@end_stops = true", "options end_stops: found True; must be text in quotes"),
    ('active_area = "60 cm^2"', "@activ_area = 60.0", "activ_area: unknown parameter; did you mean active_area?"),
    ('"60 cm^2"', '@"60 cm"', "parameters active_area: found '60 cm', which is in m; must be a number in m^2"),
    ('"60 cm^2"', "@-1.0", "parameters active_area: active_area: -1 m^2 is not possible"),
    ('signal = "flow"', '@signal = "flw"', "[[input]] 1 signal: no input 'flw'; did you mean flow?"),
    ('signal = "velocity"', '@signal = "speed"', "[[output]] 1 signal: no output 'speed'; outputs: displacement"),
    ('signal = "velocity"', '@sgnal = "velocity"', "[[output]] 1 sgnal: unknown key; did you mean signal?"),
    ('name = "v"', '@name = "flow"', "[[output]] 1 name: the name 'flow' is taken by an input"),
    ('name = "v"', 'name = "v"\n[[output]]\n@signal = "velocity"', "'velocity' is chosen twice"),
    ('"50 cm/s"', '"50 cm"', "[[effect]] 1 parameters limit: found '50 cm', which is in m; must be a number in m/s"),
    ('site = "v"', '@site = "w"', "[[effect]] 1 site: no site 'w'; sites: "),
    ('site = "v"', 'site = "flow"', "limit: found '50 cm/s', which is in m/s"),
    ("active_area = 0.02", "@active_aera = 0.02", "no parameter 'active_aera'; did you mean active_area?"),
]  # fmt: skip


@pytest.mark.parametrize(("there", "instead", "words"), DRIVE_MISTAKES)
def test_a_mistake_in_a_drive(tmp_path: Path, there: str, instead: str, words: str) -> None:
    assert DRIVE.count(there) == 1
    text = DRIVE.replace(there, instead)
    lines = told(tmp_path, text.replace("@", ""))
    matching = [line for line in lines if words in line]
    assert matching, lines
    if "@" in text:
        assert matching[0].startswith(f"m.toml:{line_of(text, '@')}: "), matching
    assert len(lines) <= 2, lines


SCHEME_MISTAKES = [
    ('kind = "pi"', '@kind = "pj"', "pj"),
    ('"9900 ms"', '"9900 mm"', "integral_time"),
    ('input = ["regulator"]', '@input = ["regulatr"]', "regulatr"),
    ('site = "speed"', '@site = "sped"', "[[effect]] 1 site: no site 'sped'; did you mean speed?"),
    ('site = "speed"', 'site = "reference"', "[[effect]] 1: clipping acts at an output, but 'reference' is an input"),
    ("den = [0.7, 1.0]", "den = [0.0]", "den"),
    ('"regulator.gain" = 0.2', '@"regulator.gian" = 0.2', "regulator.gian"),
    ('name = "loop"', 'name = "loop"\n@blck = 3', "blck: unknown key; did you mean block?"),
    ('input = ["+reference", "-plant"]\n', 'input = ["+reference", "-plant"]\n@colour = 1\n', "colour"),
]


@pytest.mark.parametrize(("there", "instead", "words"), SCHEME_MISTAKES)
def test_a_mistake_in_a_scheme(tmp_path: Path, there: str, instead: str, words: str) -> None:
    assert SCHEME.count(there) == 1
    text = SCHEME.replace(there, instead)
    lines = told(tmp_path, text.replace("@", ""))
    matching = [line for line in lines if words in line]
    assert matching, lines
    if "@" in text:
        assert matching[0].startswith(f"m.toml:{line_of(text, '@')}: "), matching


def test_all_mistakes_are_told_at_once_in_the_order_of_the_file(tmp_path: Path) -> None:
    text = (
        STRUCTURE.replace("mass = 2.5", "mass = nan")
        .replace('"0.6 kN/mm"', '"3 kg"')
        .replace('feedback = "bend"', 'feedback = "bnd"')
        .replace('site = "elbow"', 'site = "elbo"')
        .replace("default = 0.1", "default = -1")
        + "\n[extra]\n"
    )
    lines = told(tmp_path, text)
    numbers = [int(line.split(":")[1]) for line in lines]
    assert numbers == sorted(numbers)
    for words in ("found nan", "3 kg", "'bnd'", "'elbo'", "found -1", "extra: unknown key"):
        assert sum(words in line for line in lines) == 1, (words, lines)
    assert len(lines) == 6


def test_a_loop_without_solution_is_told_at_its_controller(tmp_path: Path) -> None:
    text = STRUCTURE.replace('feedback = "bend"', 'feedback = "acc_wrist"').replace('"20 V/mm"', "20.0")
    lines = told(tmp_path, text)
    assert len(lines) == 1
    assert lines[0].startswith(f"m.toml:{line_of(STRUCTURE, '[[controller]]')}: [[controller]] 1: ")
    assert "has no rate for the law pd" in lines[0]


def test_a_motion_is_prescribed_once(tmp_path: Path) -> None:
    second = '[[input]]\nname = "{}"\nat = "column"\nkind = "displacement"\n'
    lines = told(tmp_path, STRUCTURE + second.format("one") + second.format("two"))
    assert len(lines) == 1
    assert "[[input]] 6 at: the motion of 'column' is prescribed by 'one' already" in lines[0]


def test_options_that_are_no_table(tmp_path: Path) -> None:
    text = DRIVE.replace('[options]\nend_stops = "on"', "").replace('kind = "drive"', 'kind = "drive"\noptions = 3')
    assert any("options: found 3; must be a table" in line for line in told(tmp_path, text))


def test_a_scheme_whose_loop_has_no_solution(tmp_path: Path) -> None:
    text = SCHEME.replace("num = [1.0]\nden = [0.7, 1.0]", "num = [-1.0]\nden = [1.0]").replace(
        'kind = "pi"\nparameters = { gain = 2.97, integral_time = "9900 ms" }', "num = [1.0]\nden = [1.0]"
    ).replace('"regulator.gain" = 0.2', "default = 0.1")  # fmt: skip
    assert all(line.startswith("m.toml:") for line in told(tmp_path, text))


def test_an_actuator_at_a_body_that_is_driven_twice(tmp_path: Path) -> None:
    second = STRUCTURE[STRUCTURE.index("[[controller]]") : STRUCTURE.index("[[effect]]")]
    second = second.replace('"axis"', '"second"').replace("/command.position[0]", "/other")
    assert any("'motor' is driven by 'axis' already" in line for line in told(tmp_path, STRUCTURE + second))


def test_a_thousand_parts_are_enough(tmp_path: Path) -> None:
    bodies = "".join(f'[[body]]\nname = "b{n}"\nmass = 1.0\n' for n in range(1001))
    text = f'format = "chladni.model/1"\nname = "many"\nkind = "structure"\n{bodies}'
    assert "body: " in (line := told(tmp_path, text)[0])
    assert "at most 1000 items" in line


@pytest.mark.parametrize("wrong", [0, 3, 6])
def test_of_many_effects_the_one_that_does_not_fit_is_told(tmp_path: Path, wrong: int) -> None:
    head = STRUCTURE[: STRUCTURE.index("[[effect]]")]
    sites = ["elbow" if place != wrong else "wrist" for place in range(7)]
    effects = "".join(
        f'[[effect]]\neffect = "coulomb_friction"\nsite = "{site}"\nparameters = {{ force = 1.0 }}\n'
        for site in sites
    )
    (line,) = told(tmp_path, head + effects)
    assert f"[[effect]] {wrong + 1}: coulomb_friction acts at a joint" in line


def test_a_structure_without_bodies_is_refused(tmp_path: Path) -> None:
    text = 'format = "chladni.model/1"\nname = "none"\nkind = "structure"\n'
    assert told(tmp_path, text) == ["m.toml:1: body: is missing, and is needed"]


@pytest.mark.parametrize(
    "text", ["", "kind = 3", "kind = [", "\x00", 'kind = "drive"', 'kind = "scheme"', "body = 3"]
)
def test_files_that_are_no_models_are_refused(tmp_path: Path, text: str) -> None:
    assert all(line.startswith("m.toml:") for line in told(tmp_path, text))


def test_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no such file"):
        load_model(tmp_path / "none.toml")
