"""Rows of a study's tables, taken out of the documents of commands: no number is computed here."""

import json
from collections.abc import Callable, Mapping
from typing import Any, Final

from chladni.apps.documents import Document

Rows = dict[str, list[dict[str, Any]]]

_LEVELS: Final = ("mean", "rms", "rms_std", "peak", "peak_to_peak", "crest_factor", "skewness", "kurtosis")
_OF_CHANNEL: Final = (
    "encoding", "rate_hz", "rate_std_hz", "samples", "stamp", "jitter_s", "longest_stretch_s", "duplicates",
    "clipped", "untimed", "publishers",
)  # fmt: skip
_OF_MODE: Final = (
    "frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std", "mpc", "mpd_deg", "mean_phase_deg",
    "modal_mass", "modal_mass_std", "orders",
)  # fmt: skip
_OF_CLOSING: Final = ("before", "tuned", "after", "noise", "closed")


def rows_of(documents: Mapping[str, Document]) -> Rows:
    """Give the rows of all tables, from a log's documents by their step; without the columns ``log`` and ``day``."""
    found: Rows = {}
    for step, document in documents.items():
        for table, rows in _MAKERS[step](document).items():
            found.setdefault(table, []).extend(rows)
        found.setdefault("findings", []).extend(_findings(step, document))
    # Several steps say something of one channel: it has one row.
    channels: dict[str, dict[str, Any]] = {}
    for row in found.pop("channels", []):
        channels.setdefault(row["channel"], {}).update(row)
    return {"channels": list(channels.values()), **found}


def _of_info(document: Document) -> Rows:
    channels = [
        {
            "channel": one["name"],
            "unit": one["unit"],
            "gaps": len(one["gaps"]),
            "breaks": len(one["breaks"]),
            **{key: one[key] for key in _OF_CHANNEL},
        }
        for one in document["channels"]
    ]
    return {"channels": channels}


def _of_psd(document: Document) -> Rows:
    channels, peaks = [], []
    for one in document["channels"]:
        axis = document | one
        channels.append(
            {
                "channel": one["name"],
                "unit": one["channel_unit"],
                "psd_unit": one["psd_unit"],
                "psd_rms": one["rms"],
                **{key: axis[key] for key in ("averages", "effective_averages", "segment_s", "window")},
            }
        )
        peaks += [
            {
                "step": "psd",
                "channel": one["name"],
                "rank": rank,
                "frequency_hz": peak["frequency_hz"],
                "frequency_std_hz": peak["frequency_std_hz"],
                "height": peak["psd"],
                "height_std": peak["psd_std"],
                "unit": one["psd_unit"],
            }
            for rank, peak in enumerate(one["peaks"], 1)
        ]
    return {"channels": channels, "peaks": peaks}


def _of_frf(document: Document) -> Rows:
    peaks = [
        {
            "step": "frf",
            "channel": one["response"],
            "reference": one["reference"],
            "rank": rank,
            "frequency_hz": peak["frequency_hz"],
            "frequency_std_hz": peak["frequency_std_hz"],
            "height": peak["magnitude"],
            "height_std": peak["magnitude_std"],
            "unit": one["unit"],
        }
        for one in document["functions"]
        for rank, peak in enumerate(one["peaks"], 1)
    ]
    return {"peaks": peaks}


def _of_modes(document: Document) -> Rows:
    modes = [
        {
            "mode": number,
            **{key: one[key] for key in _OF_MODE},
            "estimator": document["estimator"],
            "channels": [part["channel"] for part in one["shape"]],
            **{
                f"shape_{key}": [part[key] for part in one["shape"]]
                for key in ("real", "imag", "real_std", "imag_std")
            },
        }
        for number, one in enumerate(document["modes"])
    ]
    return {"modes": modes}


def _of_levels(document: Document) -> Rows:
    levels = [
        {
            "channel": one["name"],
            "unit": one["unit"],
            **{key: band[key] for key in ("low_hz", "high_hz", "samples", *_LEVELS)},
        }
        for one in document["channels"]
        for band in one["bands"]
    ]
    channels = [
        {
            "channel": one["name"],
            "unit": one["unit"],
            **{key: one["severity"][key] for key in ("velocity_mm_s", "velocity_std_mm_s", "zone")},
        }
        for one in document["channels"]
        if one["severity"] is not None
    ]
    return {"levels": levels, "channels": channels}


def _of_gap(document: Document) -> Rows:
    gap = {
        "model": document["model"],
        "verdict": document["verdict"],
        **{key: document["gap"][key] for key in _OF_CLOSING},
        "advice": document.get("advice"),
        "next_measurement": _text(document["next_measurement"]),
    }
    causes = [
        {
            "cause": number,
            **{key: one.get(key) for key in ("effect", "site", "variant", "probability", "share")},
            "group": [_text(name) for name in one["group"]],
            "parameters": _text(one["parameters"]),
        }
        for number, one in enumerate(document["causes"])
    ]
    return {"gaps": [gap], "causes": causes}


def _text(content: Any) -> str | None:
    return content if content is None or isinstance(content, str) else json.dumps(content, ensure_ascii=False)


def _findings(step: str, document: Document) -> list[dict[str, Any]]:
    told = [*document.get("findings", []), *document.get("notes", []), *document.get("remarks", [])]
    return [
        {"step": step, "place": place, "sentence": sentence} for place, sentence in enumerate(dict.fromkeys(told), 1)
    ]


_MAKERS: Final[Mapping[str, Callable[[Document], Rows]]] = {
    "info": _of_info,
    "psd": _of_psd,
    "frf": _of_frf,
    "modes": _of_modes,
    "levels": _of_levels,
    "gap": _of_gap,
}
