"""Places: the sites of a model, put together where a force would print the same pattern on these sensors."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.plant.linear_view import View, Way
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import PortKind
from chladni.signals.arrays import Complex


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """A joint, body, input, output or the ground."""

    name: str
    kind: PortKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Sites at which a missing force prints one and the same pattern: a joint to the ground and its body, say."""

    sites: tuple[Site, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sites."""
        return tuple(site.name for site in self.sites)


def sites_of(compiled: CompiledModel, outputs: Sequence[str]) -> tuple[Site, ...]:
    """Give every site of a model at which an effect of the vocabulary may act.

    Outputs are the measured ones: an error of a sensor that isn't in the log shows nowhere.
    """
    kinds = ("joint", "body", "ground", "pair")
    ports = [Site(name=port.name, kind=port.kind) for port in compiled.ports if port.kind in kinds]
    loops = {port.name for port in compiled.ports if port.kind == "input" and not port.name.endswith(".limit")}
    names = dict.fromkeys([*(terminal.name for terminal in compiled.inputs), *sorted(loops)])
    inputs = [Site(name=name, kind="input") for name in names]
    return (*dict.fromkeys(ports), *inputs, *(Site(name=name, kind="output") for name in outputs))


def way_to(view: View, site: Site, outputs: Sequence[str]) -> Way:
    """Give how a force (change, error) at a site enters the equations; outputs are the view's."""
    has_port = any((port.name, port.kind) == (site.name, site.kind) for port in view.compiled.ports)
    if site.kind == "output" and not has_port:
        return view.way_of_output(list(outputs).index(site.name))
    if site.kind == "input" and not has_port:
        return view.way_of_input(site.name)
    return view.way_of_port(view.compiled.port_index(site.name, site.kind))


def printed_patterns(view: View, sites: Sequence[Site], outputs: Sequence[str], noise: NoiseFloor) -> Complex:
    """``[site, output, line]`` that a force of one (a change of an input, an error) at each site prints, over noise.

    Outputs are the view's, which the noise is of; one without noise counts nothing.
    """
    density = noise.density(view.lines.cycles)
    # Of an output without noise nothing is known, such as a sensor to be added where the log's input moves nothing.
    known = density > 0
    weight = np.where(known, 1.0 / np.sqrt(np.where(known, density, 1.0)), 0.0)
    found = np.zeros((len(sites), *density.shape), dtype=np.complex128)
    for place, site in enumerate(sites):
        found[place] = view.pattern(way_to(view, site, outputs)) * weight
    return found


def placed(view: View, sites: Sequence[Site], outputs: Sequence[str], noise: NoiseFloor) -> tuple[Place, ...]:
    """Put together sites whose patterns are proportional on every line, see `printed_patterns`.

    Held against its noise each sensor counts: a motor's current beside a displacement in metres has a million times
    its numbers.
    """
    acting = [site for site in sites if not _is_motion(view.compiled, site)]
    groups = printed_alike(printed_patterns(view, acting, outputs, noise), view.rounding)
    return tuple(Place(sites=tuple(acting[number] for number in group)) for group in groups)


def printed_alike(patterns: Iterable[Complex], rounding: float) -> list[list[int]]:
    """Put numbers of patterns ``[output, ..., line]`` together that are proportional on every line.

    One that prints nothing is left out.

    Parameters
    ----------
    rounding
        Share of their energy by which equal ones may differ.
    """
    found: list[tuple[list[int], Complex]] = []
    for number, printed in enumerate(patterns):
        size = np.sqrt(np.sum(np.abs(printed) ** 2, axis=0))
        if not np.any(size > 0):
            continue
        unit = printed / np.where(size > 0, size, 1.0)
        for group, known in found:
            if np.mean(np.abs(np.sum(known.conj() * unit, axis=0)) ** 2) > 1 - rounding:
                group.append(number)
                break
        else:
            found.append(([number], unit))
    return [group for group, _ in found]


def _is_motion(compiled: CompiledModel, site: Site) -> bool:
    """Whether the site is an input that prescribes a motion: its change moves through its derivatives too."""
    return site.kind == "input" and any(
        terminal.name == site.name and terminal.derivatives for terminal in compiled.inputs
    )
