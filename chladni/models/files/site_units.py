"""Units of an effect's parameters at the site where it acts."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.effects.pair import TILDE

_SYMBOL = re.compile(r"[A-Za-z]+")


@dataclass(frozen=True, slots=True, kw_only=True)
class SiteUnits:
    """What takes the place of newton and metre at a site.

    The vocabulary declares its laws for translation: at a joint that rotates ``N/m`` means N m/rad, the ``N`` of a
    limited input is the input's unit, and the ``m/s^2`` of a clipped output the output's.

    Attributes
    ----------
    force
        Of what a law adds there.
    displacement
        Of the motion there.
    signal
        Of an output; None elsewhere.
    """

    force: str = "N"
    displacement: str = "m"
    signal: str | None = None

    def of(self, unit: str) -> str:
        """Unit of a parameter that the vocabulary declares in `unit`.

        Examples
        --------
        >>> turning = SiteUnits(force="N m", displacement="rad")
        >>> turning.of("N s/m"), turning.of("kg"), SiteUnits(force="V").of("N/s")
        ('N m s/rad', 'kg m^2', 'V/s')
        """
        if self.signal is not None and unit == "m/s^2":
            return self.signal
        force = f"({self.force})" if "/" in self.force else self.force
        inertia = "kg m^2" if self.displacement == "rad" else "kg"
        meant = {"N": force, "m": self.displacement, "kg": inertia}
        return _SYMBOL.sub(lambda symbol: meant.get(symbol[0], symbol[0]), unit)


def known_site(site: str, sites: Mapping[str, SiteUnits | None]) -> bool:
    """Whether a site is one of the model's, or a pair of two.

    Examples
    --------
    >>> known_site("arm~hand", {"arm": None, "hand": None}), known_site("arm~foot", {"arm": None, "hand": None})
    (True, False)
    """
    first, tilde, second = site.partition(TILDE)
    return site in sites or (bool(tilde) and first in sites and second in sites)


def sites_like(site: str, sites: Mapping[str, SiteUnits | None]) -> list[str]:
    """Give the names that a site which there is not may have meant: of a pair, pairs with the half that is known.

    Examples
    --------
    >>> sites_like("arm~hnad", {"arm": None, "hand": None}), sites_like("hnad", {"arm": None, "hand": None})
    (['arm~hand'], ['arm', 'hand'])
    """
    first, tilde, second = site.partition(TILDE)
    pairs = [TILDE.join((first, one)) for one in sites if first in sites and one != first]
    pairs += [TILDE.join((one, second)) for one in sites if second in sites and one != second]
    return pairs if tilde and pairs else list(sites)


def units_at(site: str, sites: Mapping[str, SiteUnits | None]) -> SiteUnits | None:
    """Give the units at a known site; of a pair those of its second, which both have but for the ground."""
    if site in sites:
        return sites[site]
    first, _, second = site.partition(TILDE)
    return sites[first if second == "ground" else second]


def compiled_site_units(compiled: CompiledModel) -> Mapping[str, SiteUnits]:
    """Units at every site of a compiled model, by name."""
    units = {
        port.name: SiteUnits(force=port.unit, displacement=port.displacement_unit)
        for port in compiled.ports
        if port.kind in ("joint", "body", "ground")
    }
    units |= {one.name: SiteUnits(force=one.unit, signal=one.unit) for one in compiled.outputs}
    return units | {one.name: SiteUnits(force=one.unit) for one in compiled.inputs}
