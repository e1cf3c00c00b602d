"""Put clock histories with known truth through ``chladni info`` and ``psd``: right, refused or silently wrong.

Right is a rate within a thousandth (or three of the sigmas that are told), the number of breaks, the longest
stretch to a sample, and a highest peak within half a line of the tone with no other above a hundredth of it.
Refused is an answer that says so; what it tells to do is done, and must lead to what is right.
"""

import argparse
import contextlib
import io
import json
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clock_histories import History, histories

from chladni.cli.main import main as chladni

# Peaks lower than the highest by more than this aren't taken for wrong: a window's skirts and noise.
FALSE_PEAK = 0.01
RATE = 1e-3


@dataclass(frozen=True)
class Answer:
    """What a command said."""

    code: int
    document: Any
    text: str


@dataclass(frozen=True)
class Judged:
    """One history, judged."""

    history: History
    verdict: str
    info: str
    psd: str


def run(*arguments: str) -> Answer:
    """Run a command in this process."""
    # Documents are written as bytes.
    written, err = io.BytesIO(), io.StringIO()
    out = io.TextIOWrapper(written, encoding="utf-8")
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = chladni([*arguments, "--json", "-"])
    out.flush()
    document = json.loads(written.getvalue()) if code == 0 else None
    return Answer(code, document, err.getvalue())


def remedy(history: History, answer: Answer) -> list[str]:
    """Options that an answer tells to give; empty when it tells none."""
    text = " ".join(answer.text.split())
    options: list[str] = []
    if "--rate HZ" in text:
        options += ["--rate", f"{history.rate_hz:.12g}"]
    if found := re.search(r"--stamp (log|publish|header)", text):
        options += ["--stamp", found[1]]
    if found := re.search(r"ask for ([\d.e+-]+) Hz or coarser", text):
        options += ["--resolution", found[1]]
    if found := re.search(r"(/s\{@publisher==1\}\S*?)[,; ]", text):
        options += ["--channel", found[1]]
    return options


def judge_info(history: History, answer: Answer) -> tuple[str, str]:
    """Say whether the survey is right, and what it told."""
    if answer.code:
        return "refused", "-"
    channel = answer.document["channels"][0]
    rate_hz, breaks, longest_s = channel["rate_hz"], channel.get("breaks"), channel.get("longest_stretch_s")
    told = f"{rate_hz or 0:.6g} Hz, {len(breaks) if breaks is not None else '?'} breaks, {longest_s or 0:.5g} s"
    if longest_s is None and channel.get("rate_std_hz") is None and breaks is not None:
        return "refused", told
    sigma_hz = channel.get("rate_std_hz") or 0.0
    wrong = []
    if abs((rate_hz or 0) - history.rate_hz) > max(RATE * history.rate_hz, 3 * sigma_hz):
        wrong.append("rate")
    if breaks is None or len(breaks) != history.breaks:
        wrong.append("breaks")
    if (
        history.longest_s
        and history.longest_s > 0
        and (
            longest_s is None
            or abs(longest_s - history.longest_s) > 1.01 / history.rate_hz + RATE * history.longest_s
        )
    ):
        wrong.append("stretch")
    return ("wrong " + "+".join(wrong) if wrong else "right"), told


def judge_psd(history: History, answer: Answer) -> tuple[str, str]:
    """Say whether the spectrum is right, and what it told."""
    if answer.code:
        return "refused", "-"
    channel = answer.document["channels"][0]
    frequency_hz = answer.document["frequency_hz"]
    spacing_hz, peaks = frequency_hz[1] - frequency_hz[0], channel["peaks"]
    if not peaks:
        # Without a peak the highest line must still be the tone's.
        highest = max(range(1, len(channel["psd"])), key=lambda line: channel["psd"][line])
        peaks = [{"frequency_hz": frequency_hz[highest], "psd": channel["psd"][highest]}]
    told = f"{peaks[0]['frequency_hz']:.5g} Hz of {history.tone_hz:.5g} Hz"
    near = max(0.5 * spacing_hz, RATE * history.tone_hz)
    if abs(peaks[0]["frequency_hz"] - history.tone_hz) > near:
        return "wrong peak", told
    false = [
        one for one in peaks[1:]
        if one["psd"] > FALSE_PEAK * peaks[0]["psd"] and abs(one["frequency_hz"] - history.tone_hz) > 3 * spacing_hz
    ]  # fmt: skip
    return ("wrong peaks" if false else "right"), told


def judge(history: History, folder: Path) -> Judged:
    """Write the log, ask, and follow what is told where the answer is none."""
    path = folder / "log.mcap"
    history.write(path)
    info, psd = run("info", str(path)), run("psd", str(path))
    (info_is, info_told), (psd_is, psd_told) = judge_info(history, info), judge_psd(history, psd)
    if "wrong" in info_is or "wrong" in psd_is:
        verdict = ", ".join(f"{name}: {one}" for name, one in (("info", info_is), ("psd", psd_is)) if "wrong" in one)
        return Judged(history, f"SILENTLY {verdict}", info_told, psd_told)
    if info_is == psd_is == "right":
        return Judged(history, "right", info_told, psd_told)
    options = remedy(history, psd if psd.code else info)
    if not options:
        return Judged(history, "refused without a remedy", info_told, psd_told)
    again = run("psd", str(path), *options)
    psd_is, psd_told = judge_psd(history, again)
    for_info = [
        one
        for pair in zip(options[::2], options[1::2], strict=True)
        if pair[0] in ("--rate", "--stamp")
        for one in pair
    ]
    info_is, info_told = judge_info(history, run("info", str(path), *for_info)) if for_info else (info_is, info_told)
    works = psd_is == "right" and info_is in ("right", "refused")
    verdict = f"refused; {' '.join(options)} {'works' if works else f'FAILS (info {info_is}, psd {psd_is})'}"
    return Judged(history, verdict, info_told, psd_told)


def main() -> None:
    """Print a row for each history, and the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="only histories whose name holds this")
    only = parser.parse_args().only
    print("| history | is | info | highest peak |")
    print("| --- | --- | --- | --- |")
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for history in histories():
            if only in history.name:
                found.append(judge(history, Path(folder)))
                one = found[-1]
                print(f"| {one.history.name} | {one.verdict} | {one.info} | {one.psd} |", flush=True)
    counts = {
        "right": sum(one.verdict == "right" for one in found),
        "refused with a remedy that works": sum(one.verdict.endswith("works") for one in found),
        "refused without": sum("FAILS" in one.verdict or "without" in one.verdict for one in found),
        "silently wrong": sum("SILENTLY" in one.verdict for one in found),
    }
    print(f"\n{len(found)} histories: " + ", ".join(f"{count} {what}" for what, count in counts.items()))


if __name__ == "__main__":
    main()
