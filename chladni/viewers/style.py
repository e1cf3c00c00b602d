"""What all pictures of one study share: a label and a colour for each channel, and the start of its clock."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Bytes, Real
from chladni.signals.channel import Channel, labels_of
from chladni.signals.study import Study

Colour = tuple[int, int, int]

# Okabe and Ito's colours, told apart with any colour vision; the dark set is the same hues, lightened until they
# read on a black ground, the light set darkened until they read on paper.
ON_LIGHT: tuple[Colour, ...] = (
    (0, 114, 178),
    (213, 94, 0),
    (0, 145, 106),
    (188, 92, 150),
    (200, 134, 0),
    (64, 156, 214),
    (112, 84, 62),
    (96, 96, 96),
)
ON_DARK: tuple[Colour, ...] = (
    (86, 180, 233),
    (240, 125, 50),
    (40, 195, 150),
    (225, 145, 190),
    (235, 190, 60),
    (140, 160, 255),
    (205, 170, 140),
    (190, 190, 190),
)
# Of poles, in the order of POLE_STATUSES: grey for those that nothing confirms, then from warm to green.
STATUS_ON_LIGHT: tuple[Colour, ...] = ((160, 160, 160), (213, 94, 0), (0, 114, 178), (0, 145, 106))
STATUS_ON_DARK: tuple[Colour, ...] = ((105, 105, 105), (240, 125, 50), (86, 180, 233), (40, 195, 150))
# Amplitude, low to high: blue, teal, yellow, red-orange; also told apart in grey, and on both grounds.
AMPLITUDES = np.array([(40, 70, 160), (40, 160, 160), (235, 190, 60), (250, 90, 40)], dtype=np.float64)


def amplitude_colours(share: NDArray[np.floating]) -> Bytes:
    """Give ``[..., rgb]`` of amplitudes from 0 to 1; what lies outside has the colour of the end."""
    return _colours(AMPLITUDES, share)


# Modal assurance: from the ground of a dark picture over blue to yellow, so that likeness shines.
LIKENESS = np.array([(18, 22, 40), (30, 75, 130), (20, 135, 140), (120, 175, 70), (235, 190, 60)], dtype=np.float64)


def mac_colours(mac: NDArray[np.floating]) -> Bytes:
    """Give ``[..., rgb]`` of modal assurance criteria from 0 to 1."""
    return _colours(LIKENESS, mac)


def level_colours(share: NDArray[np.floating]) -> Bytes:
    """Give ``[..., rgb]`` of levels of a waterfall from 0 to 1, on a dark ground; what isn't known is grey."""
    return np.where(np.isnan(share)[..., None], np.uint8(UNKNOWN), _colours(LIKENESS, share))


# In no part of the scale: what is missing can't be taken for a low level.
UNKNOWN = 110


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """Label and colour number of each channel of a study, by channel name.

    Attributes
    ----------
    labels
        Short unambiguous label.
    numbers
        Place in the palette, 0 to 7: the same in every picture, and different for channels of one unit that are
        drawn together.
    origin_ns
        Nanoseconds since the Unix epoch that pictures call second 0.
    """

    labels: dict[str, str]
    numbers: dict[str, int]
    origin_ns: int

    @classmethod
    def of(cls, study: Study) -> Self:
        """Give the style of all pictures of `study`."""
        return cls.of_channels(drawn_channels(study), origin_ns=min(_starts(study), default=0))

    @classmethod
    def of_channels(cls, drawn: Iterable[Channel], *, origin_ns: int = 0) -> Self:
        """Give the style of pictures of these channels, which may come several times."""
        # By name: a channel in a series, its density and its response is one channel.
        channels = {channel.name: channel for channel in drawn}
        units: dict[str, list[str]] = {}
        for channel in channels.values():
            units.setdefault(channel.unit, []).append(channel.name)
        # Units one after another, so that neighbours in a plot of one unit are neighbours in the palette.
        ordered = [name for names in units.values() for name in names]
        return cls(
            labels=labels_of(channels.values()),
            numbers={name: place % len(ON_DARK) for place, name in enumerate(ordered)},
            origin_ns=origin_ns,
        )

    def on_dark(self, channel: Channel) -> Colour:
        """Give the channel's colour on a dark ground."""
        return ON_DARK[self.numbers[channel.name]]

    def on_light(self, channel: Channel) -> Colour:
        """Give the channel's colour on paper."""
        return ON_LIGHT[self.numbers[channel.name]]


def _colours(scale: Real, share: NDArray[np.floating]) -> Bytes:
    # What isn't known has the lowest colour.
    place = np.nan_to_num(np.clip(share, 0, 1)) * (len(scale) - 1)
    parts = [np.interp(place, np.arange(len(scale)), scale[:, part]) for part in range(3)]
    return np.stack(parts, axis=-1).astype(np.uint8)


def drawn_channels(study: Study) -> Iterator[Channel]:
    """Give the channels of all results of a study; one of several results comes several times."""
    for series in study.series:
        yield from series.channels
    for density in study.densities:
        yield from density.channels
    for waterfall in study.waterfalls:
        yield from waterfall.channels
    for levels in study.levels:
        yield from levels.channels
    for severity in study.severities:
        yield from severity.channels
    for octaves in study.octaves:
        yield from octaves.channels
    yield from (envelope.channel for envelope in study.envelopes)
    for cepstrum in study.cepstra:
        yield from cepstrum.channels
    if study.response is not None:
        yield from (*study.response.references, *study.response.responses)
    if study.modes is not None:
        yield from (*study.modes.references, *study.modes.channels)


def _starts(study: Study) -> Iterator[int]:
    yield from (series.start_time_ns for series in study.series)
    yield from (waterfall.start_time_ns for waterfall in study.waterfalls)
    yield from (levels.running.start_time_ns for levels in study.levels)
    yield from (severity.running.start_time_ns for severity in study.severities)
