"""Whether commands write the same bytes at one, two and four threads of linear algebra, and on one core."""

import argparse
import hashlib
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MODEL = (
    """format = "chladni.model/1"
name = "chain"
kind = "structure"
"""
    + "".join(
        f"""[[body]]
name = "m{place}"
mass = 2.0
[[joint]]
name = "j{place}"
between = ["{"ground" if place == 0 else f"m{place - 1}"}", "m{place}"]
stiffness = 8e4
damping = 20.0
[[output]]
name = "y{place}"
measures = "acceleration"
at = "m{place}"
channel = "/m{place}.accel"
"""
        for place in range(8)
    )
    + """[[input]]
name = "f"
at = "m7"
channel = "/m7.force"
"""
)
#: Commands by name; each runs in a folder of its own, beside the logs that `prepared` made.
COMMANDS: dict[str, tuple[str, ...]] = {
    "psd": ("psd", "{log}", "--json", "out.json"),
    "frf": ("frf", "{log}", "--reference", "/m7.force", "--json", "out.json"),
    "modes": ("modes", "{log}", "--json", "out.json", "--uff", "out.uff", "--csv", "out.csv"),
    "modes --operational": ("modes", "{log}", "--operational", "--json", "out.json"),
    "compare": ("compare", "{log}", "{other}", "--json", "out.json"),
    "simulate": (
        "simulate",
        "{model}",
        "--out",
        "out.mcap",
        "--seconds",
        "20",
        "--noise",
        "0.01",
        "--json",
        "o.json",
    ),
    "influence": ("influence", "{model}", "--json", "out.json"),
    "convert": ("convert", "{log}", "out.mat"),
    "gap": ("gap", "{model}", "{other}", "--json", "out.json"),
}
#: Threads that the environment asks for, and cores (all if None).
WAYS: tuple[tuple[int, str | None], ...] = ((1, None), (2, None), (4, None), (2, "0"))


def run(command: tuple[str, ...], folder: Path, threads: int, cores: str | None) -> float:
    """Run a command in a folder; give its seconds."""
    environment = dict(os.environ, OPENBLAS_NUM_THREADS=str(threads), OMP_NUM_THREADS=str(threads))
    pinned = [] if cores is None else ["taskset", "-c", cores]
    begun = time.perf_counter()
    done = subprocess.run(
        [*pinned, sys.executable, "-m", "chladni", *command],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")
    (folder / "standard output").write_text(done.stdout)
    return time.perf_counter() - begun


def written(folder: Path) -> dict[str, str]:
    """Digest of each file."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())}


def prepared(folder: Path) -> dict[str, str]:
    """Write a model and two logs of it; give their paths by name."""
    model = folder / "chain.toml"
    model.write_text(MODEL)
    paths = {"model": str(model)}
    for name, changes in (("log", ()), ("other", ("--effect", "coulomb_friction@j3:force=0.5", "--seed", "1"))):
        paths[name] = str(folder / f"{name}.mcap")
        seconds = ("--seconds", "60", "--rate", "500", "--noise", "0.01")
        run(("simulate", str(model), "--out", paths[name], *seconds, *changes), folder, 1, None)
    return paths


def differing(command: tuple[str, ...]) -> tuple[list[str], list[float]]:
    """Files of a command that aren't the same in all ways, and its seconds in each."""
    found, seconds = [], []
    for threads, cores in WAYS:
        with tempfile.TemporaryDirectory() as place:
            seconds.append(run(command, Path(place), threads, cores))
            found.append(written(Path(place)))
    names = dict.fromkeys(name for one in found for name in one)
    return [name for name in names if len({one.get(name) for one in found}) > 1], seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("commands", nargs="*", metavar="COMMAND", help=f"of {', '.join(COMMANDS)}; all if none")
    wanted = parser.parse_args().commands or list(COMMANDS)
    ways = [f"{threads} threads{'' if cores is None else ', one core'}" for threads, cores in WAYS]
    print(f"| command | {' | '.join(ways)} | differs |")
    print(f"| --- |{' ---: |' * len(WAYS)} --- |")
    bad = 0
    with tempfile.TemporaryDirectory() as place:
        paths = prepared(Path(place))
        for name in wanted:
            files, seconds = differing(tuple(part.format(**paths) for part in COMMANDS[name]))
            bad += bool(files)
            times = " | ".join(f"{one:.1f} s" for one in seconds)
            print(f"| {name} | {times} | {', '.join(files) or '-'} |", flush=True)
    raise SystemExit(f"{bad} of {len(wanted)} commands depend on the number of threads" if bad else 0)


if __name__ == "__main__":
    main()
