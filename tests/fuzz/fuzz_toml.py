"""Damaged and odd files in TOML: ``python tests/fuzz/fuzz_toml.py --inputs 20000 --seed 1``.

Setup files, model files (structure, drive, scheme, with effects and controllers) and variants. The rules:

1. A key that nobody knows, and a number that isn't one, are refused.
2. A model that is read is written, and read again as the same.
"""

import random
import sys
from pathlib import Path

from damage import BYTES, ODD_TEXTS, TEXTS, damaged
from harness import WHOLE, BrokenRuleError, Case, Format, main

import chladni
from chladni.models.files.variants_file import read_variants
from chladni.models.instruments.catalogue import INSTRUMENTS
from chladni.signals.errors import ChladniError
from tests.io.test_setup import WHOLE as SETUP
from tests.models.files.made_files import DRIVE, SCHEME, STRUCTURE

VARIANTS = """format = "chladni.variants/1"

[[variant]]
name = "light"
active_area = "60 cm^2"
reduced_mass = 350.0

[[variant]]
name = "heavy"
reduced_mass = 500.0
"""
MOTOR = INSTRUMENTS["pneumatic-motor"]
ROWS = "name,active_area [cm^2],reduced_mass\nlight,60,350\nheavy,,500\n"
FILES = {
    "setup.toml": SETUP, "structure.toml": STRUCTURE, "drive.toml": DRIVE, "scheme.toml": SCHEME,
    "variants.toml": VARIANTS, "variants.csv": ROWS,
}  # fmt: skip
ODD_VALUES = (
    "1_0", "0x10", "9" * 5000, "inf", "-nan", "1e400", "-1", "0", "true", '""', "''", "[]", "{}", "[[1]]",
    "07:32:00", "1979-05-27", "[1, 2, 3, 4]", '"ground"', '"1 kg"', '"1e400 kg"', '"N"', '"\\u0000"', '"\\u001b[31m"',
    '"\\ud800"', '"' + "9" * 5000 + ' kg"', "[" * 2000 + "]" * 2000, "{a=" * 500 + "1" + "}" * 500,
    '"""\n[[joint]]\n"""',
    "[" + "1, " * 3000 + "]", "9223372036854775808", "-0.0", '"a~b"', '"1 m/s^99999999"', '"1 kg^2^2"', '"1 [kg]"',
    "0b1", "1e308", "1e-320", "[1e308, 1e308, 1e308]",
)  # fmt: skip
NO_NUMBERS = (
    "1_0", "0x10", "１２", "1,5", "1e", "--1", "²", "1 0", "nan", "inf", "", "1e5e5", "0b1", "٣", "½", "1.5.5", "+",
)  # fmt: skip
"""Put in quotes before the unit of a mass, they're no mass."""
UNKNOWN = ("unheard_of = 1\n", '"\\u001b[31m" = 1\n', '"" = 1\n', "a.b.c = 1\n", "__class__ = 1\n", "NAME = 1\n")


def odd(text: str, rng: random.Random) -> tuple[str, str, bool]:
    """Change a file as no editor would; give it, how, and whether it has to be refused."""
    lines = text.splitlines(keepends=True)
    what = rng.choice(("value", "value", "value", "key", "table", "dots", "many", "keys", "number", "names"))
    valued = [at for at, line in enumerate(lines) if "=" in line]
    at = rng.choice(valued or [0])
    key = lines[at].partition("=")[0]
    if what == "value":
        odd = rng.choice(ODD_VALUES)
        lines[at] = f"{key}= {odd}\n"
        return "".join(lines), f"{key.strip()} = {odd[:40]}", False
    if what == "key":
        lines.insert(at, rng.choice(UNKNOWN))
        return "".join(lines), f"unknown {lines[at].strip()}", True
    if what == "table":
        at = rng.randrange(len(lines) + 1)
        lines.insert(
            at,
            rng.choice(("[[body]]\n", "[joint]\n", "[a.b]\n", "[tolerance]\n", "[[joint.x]]\n", "[[odd]]\n" * 3000)),
        )
        return "".join(lines), f"table {lines[at][:20].strip()}", False
    if what == "dots":
        lines.insert(at, ".".join("a" * rng.choice((2, 100, 5000))) + " = 1\n")
        return "".join(lines), "dots", False
    if what == "many":
        block = rng.choice(text.split("\n\n")) + "\n"
        return text + "\n" + block * rng.choice((2, 50, 1000)), f"many {block[:20].strip()}", False
    if what == "keys":
        lines.insert(at, "".join(f"unknown{number} = 1\n" for number in range(rng.choice((60, 1000, 20_000)))))
        return "".join(lines), "many unknown keys", True
    if what == "names":
        lines[at] = f'{key}= "{rng.choice(ODD_TEXTS)[:300]}"\n'
        return "".join(lines), f"{lines[at][:40]!r}", False
    no_number = rng.choice(NO_NUMBERS)
    changed = text
    for number, unit in (("12", " kg"), ("60", " cm^2"), ("100", " mV/g"), ("9900", " ms")):
        changed = changed.replace(f'"{number}{unit}"', f'"{no_number}{unit}"')
    changed = changed.replace(",60,", f',"{no_number}",')
    return changed, f"no number {no_number!r}", changed != text and bool(no_number)


def make(rng: random.Random) -> Case:
    """Damage one of the files."""
    name = rng.choice(list(FILES))
    text, refused = FILES[name], False
    if rng.random() < 0.5 and name != "variants.csv":
        text, how, refused = odd(text, rng)
        content = text.encode("utf-8", "surrogatepass")
    else:
        content, how = damaged(text.encode(), rng, TEXTS if rng.random() < 0.8 else BYTES)
    return Case(files={name: content}, how=f"{name}: {how}", truth=refused)


def read_model(path: Path) -> None:
    """Read a model, write it, and read it again."""
    model = chladni.load_model(path)
    copy = path.with_name("copy.toml")
    try:
        chladni.write_model(model, copy)
        again = chladni.load_model(copy)
    except ChladniError as error:
        raise BrokenRuleError("a model that was read can't be written", str(error)[:300]) from error
    if again.parameters.numbers() != model.parameters.numbers():
        raise BrokenRuleError("a model isn't read as it was written", str(again.parameters.numbers())[:200])


def read(path: Path, case: Case) -> str:
    """Read a file by what it's for."""
    if path.stem == "setup":
        chladni.load_setup(path)
    elif path.stem == "variants":
        read_variants(path, MOTOR.parameters, MOTOR.options)
    else:
        read_model(path)
    if case.truth:
        raise BrokenRuleError("a mistake is taken", case.how)
    return WHOLE


def command(path: Path, rng: random.Random) -> list[str]:
    """Any command that takes a model; a setup goes with a table."""
    if path.stem == "setup":
        table = path.with_name("a.csv")
        table.write_text("time [s],/hammer.force.z\n" + "".join(f"{row / 100},{row % 7}\n" for row in range(20)))
        return ["info", str(table), "--setup", str(path)]
    if path.stem == "variants":
        # A log that isn't there keeps the bench from serving.
        return ["bench", MOTOR.name, "--variants", str(path), "--no-open", "--log", str(path.with_name("none.mcap"))]
    simulated = ["simulate", str(path), "--out", str(path.with_name("o.mcap")), "--seconds", "0.1", "--rate", "1000"]
    return rng.choice((["influence", str(path)], simulated))


FORMAT = Format(name="toml", make=make, read=read, command=command)

if __name__ == "__main__":
    sys.exit(main(["toml"]))
