"""Damaged and odd JSON of a blind check: ``python tests/fuzz/fuzz_blind.py --inputs 20000 --seed 1``.

A case, its sealed truth and its result; one of the three is damaged. The rules:

1. A truth that was changed after it was sealed isn't scored, nor is one whose case has another seal.
2. The score is JSON of finite numbers.
"""

import json
import random
import sys
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from damage import BYTES, damaged, odd_json
from harness import TOLD, WHOLE, BrokenRuleError, Case, Format, main

from chladni.signals.errors import ChladniError
from chladni_withheld.folders import seal_case, seal_of
from chladni_withheld.score import score_cases

CASE, TRUTH, RESULT = "cases/one/case.json", "truth/one.json", "results/one.json"
MEANT = {
    "kind": "effect", "coloured": False, "ratio": 8.0, "ratio_tuned": 6.0, "ideal": 0.97, "off": {},
    "effects": [{"effect": "coulomb_friction", "site": "elbow", "parameters": {"force": 8.1}}],
}  # fmt: skip
ANSWER = {
    "format": "chladni.gap/1", "model": "arm", "logs": ["log.mcap"], "verdict": "effect",
    "causes": [
        {"effect": "coulomb_friction", "site": "elbow", "probability": 0.97, "group": ["elbow"],
         "alternatives": [{"effect": "hysteresis", "site": "elbow"}],
         "parameters": {"force": {"value": 8.1, "std": 0.2, "unit": "N"}}},
    ],
    "ranking": [
        {"effect": "coulomb_friction", "site": "elbow", "probability": 0.97, "gap": 0.012, "log_evidence": -123.4},
        {"effect": "hysteresis", "site": "elbow", "probability": 0.02, "gap": 0.031, "log_evidence": -130.2},
    ],
    "gap": {"before": 0.41, "tuned": 0.35, "after": 0.012, "noise": 0.01, "closed": 0.995, "interval": [0.99, 0.998]},
}  # fmt: skip


@cache
def campaign() -> Mapping[str, bytes]:
    """Seal a case and answer it."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        root = Path(folder)
        (root / "cases" / "one").mkdir(parents=True)
        for name in ("model.toml", "log.mcap"):
            (root / "cases" / "one" / name).write_bytes(b"sealed")
        seal_case(root, "one", MEANT)
        files = {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.is_file()}
    return {**files, RESULT: json.dumps(ANSWER).encode()}


def make(rng: random.Random) -> Case:
    """Damage the result, now and then the truth or the case, before or after it's sealed."""
    name = rng.choice((RESULT, RESULT, RESULT, TRUTH, CASE))
    sound = campaign()[name]
    if name == TRUTH and rng.random() < 0.5:
        return sealed_odd(rng)
    # Documents are damaged in one line, as they are parsed.
    plain = json.dumps(json.loads(sound)).encode()
    content, how = damaged(plain, rng, (odd_json,) if rng.random() < 0.6 else (*BYTES, odd_json, odd_json))
    broken = name != RESULT and _sealed(content, name) != _sealed(sound, name)
    files = {name: content, **{key: one for key, one in campaign().items() if key != name}}
    return Case(files=files, how=f"{name}: {how}", truth=broken)


def _sealed(content: bytes, name: str) -> object:
    """Give what the seal is about: all of a truth, of a case the seal itself."""
    try:
        document = json.loads(content)
        return document if name == TRUTH else document.get("seal")
    except (ValueError, RecursionError, AttributeError):
        return None


def sealed_odd(rng: random.Random) -> Case:
    """Seal a truth that says what no truth does."""
    content, how = damaged(campaign()[TRUTH], rng, (odd_json,))
    files = dict(campaign())
    try:
        truth = json.loads(content)
        files[CASE] = json.dumps(json.loads(files[CASE]) | {"seal": seal_of(truth)}).encode()
    except (ValueError, RecursionError, AttributeError, TypeError, ChladniError):
        # What can't be sealed is a truth that was damaged after it was.
        pass
    return Case(files={TRUTH: content, **(files | {TRUTH: content})}, how=f"sealed {TRUTH}: {how}", truth=False)


def read(path: Path, case: Case) -> str:
    """Score the campaign."""
    folder = next(one for one in path.parents if (one / "results").is_dir())
    score: dict[str, Any] = score_cases(folder)
    json.dumps(score, allow_nan=False)
    if case.truth:
        raise BrokenRuleError("a broken seal is scored", case.how)
    return TOLD if score["missing"] or score["failed"] else WHOLE


def command(path: Path, rng: random.Random) -> list[str]:
    """Score it."""
    return ["blind", "score", str(next(one for one in path.parents if (one / "results").is_dir()))]


FORMAT = Format(name="blind", make=make, read=read, command=command)

if __name__ == "__main__":
    sys.exit(main(["blind"]))
