"""Valid logs as odd as they may be: ``python tests/fuzz/fuzz_valid.py --inputs 3000 --seed 1``.

The logs and the comparison are those of `differential`, under the watchdog: every number that other readers find in a
random valid log is read, at its time.
"""

import random
import sys
from pathlib import Path

from differential import DifferenceError, compare, make_log
from harness import WHOLE, BrokenRuleError, Case, Format, main
from samples import log_command

from chladni.signals.errors import ChladniError


def make(rng: random.Random) -> Case:
    """Write a random valid log."""
    made = make_log(rng)
    return Case(files={"a.mcap": made.content}, how=made.manner, truth=made)


def read(path: Path, case: Case) -> str:
    """Compare it with what other readers find."""
    try:
        compare(case.truth, path)
    except DifferenceError as error:
        raise BrokenRuleError("a number differs", str(error)) from error
    except ChladniError as error:
        raise BrokenRuleError("a valid log is refused", str(error)) from error
    return WHOLE


FORMAT = Format(name="valid", make=make, read=read, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["valid"]))
