"""Write docs/benchmark-tables.md: what the benchmarks beside others print, one after the other on this machine.

    python benchmarks/write_tables.py

Takes about ten minutes on an idle machine with two cores. Names of benchmarks as arguments run these alone and keep
what the page says of the others: `python benchmarks/write_tables.py cross_spectra ssi`.
"""

import os
import platform
import re
import subprocess
import sys
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

HERE = Path(__file__).parent
PAGE = HERE.parent / "docs" / "benchmark-tables.md"
TITLES = {
    "reading": "MCAP to arrays",
    "cross_spectra": "Cross-spectra of all pairs",
    "plscf": "Poles and shapes from frequency responses",
    "ssi": "Modes from responses alone",
    "integrator": "A structure with a hysteretic joint",
    "schemes": "Block schemes",
    "start": "From the command to the answer",
}
HEAD = """# Benchmarks, as they print

Written by `python benchmarks/write_tables.py`; nobody types here. What the numbers mean: [measured](benchmarks.md).
"""


def printed(name: str) -> str:
    """What a benchmark prints, headings lowered below this page's."""
    told = subprocess.run(
        [sys.executable, HERE / f"bench_{name}.py"], check=True, capture_output=True, text=True, cwd=HERE.parent
    ).stdout
    return re.sub(r"^#", "###", told.strip(), flags=re.MULTILINE)


def machine() -> str:
    """When and on what."""
    packages = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "numba"))
    return f"{datetime.now(UTC).date()}, {os.cpu_count()} processors, Python {platform.python_version()}, {packages}."


def sections() -> dict[str, str]:
    """What the page holds by now, by title."""
    parts = PAGE.read_text().split("\n## ")[1:] if PAGE.exists() else []
    return {part.partition("\n")[0]: part.partition("\n")[2].strip() for part in parts}


def main() -> None:
    """Run, and write after each: one that fails leaves the others'."""
    kept = sections()
    for name in sys.argv[1:] or TITLES:
        print(name, flush=True)
        kept[TITLES[name]] = f"`benchmarks/bench_{name}.py`, {machine()}\n\n{printed(name)}"
        held = [f"## {title}\n{kept[title]}\n" for title in TITLES.values() if title in kept]
        PAGE.write_text("\n".join([HEAD, *held]))


if __name__ == "__main__":
    main()
