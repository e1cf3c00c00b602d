"""The recipe as pydantic models; imported only when one is read, since pydantic takes a quarter of a second."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

Number = Annotated[float, Field(strict=True)]
Positive = Annotated[float, Field(strict=True, gt=0)]
Count = Annotated[int, Field(strict=True, ge=1)]
Text = Annotated[str, Field(min_length=1, max_length=1000)]
Texts = Annotated[list[Text], Field(min_length=1, max_length=10_000)]


def _rising(band: tuple[float, float]) -> tuple[float, float]:
    if band[0] >= band[1]:
        raise ValueError(f"the band from {band[0]:g} to {band[1]:g} Hz is empty; the lower end comes first")
    return band


Band = Annotated[tuple[Annotated[float, Field(strict=True, ge=0)], Positive], AfterValidator(_rising)]
Flag = Annotated[bool, Field(strict=True)]
JoinName = Literal["auto", "hold", "band-limited"]

FROM_RESPONSES = ("ssi-cov", "fdd", "efdd")


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, frozen=True)


class _Spanned(_Table):
    start_s: Number | None = None
    end_s: Number | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.start_s is not None and self.end_s is not None and self.start_s >= self.end_s:
            raise ValueError(f"start_s {self.start_s:g} must be before end_s {self.end_s:g}")
        return self


class _Averaged(_Spanned):
    resolution_hz: Positive | None = None
    window: Text | None = None
    overlap: Annotated[float, Field(strict=True, ge=0, lt=1)] | None = None
    highest_hz: Positive | None = None


class InfoTable(_Table):
    """``[info]``: as ``chladni info``."""


class PsdTable(_Averaged):
    """``[psd]``: as ``chladni psd``."""

    channels: Texts | None = None


class FrfTable(_Averaged):
    """``[frf]``: as ``chladni frf``."""

    references: Texts | None = None
    responses: Texts | None = None
    estimator: Literal["H1", "H2", "Hv"] = "H1"
    join: JoinName = "auto"


class ModesTable(_Spanned):
    """``[modes]``: as ``chladni modes``."""

    references: Texts | None = None
    operational: Flag = False
    channels: Texts | None = None
    band_hz: Band | None = None
    count: Count | None = None
    frequencies_hz: Annotated[list[Positive], Field(min_length=1)] | None = None
    method: Literal["plscf", "circle-fit", "half-power", "ssi-cov", "fdd", "efdd"] | None = None
    resolution_hz: Positive | None = None
    join: JoinName = "auto"

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        alone = self.operational or self.method in FROM_RESPONSES
        if self.references is not None and alone:
            what = "operational" if self.operational else f"method {self.method}"
            raise ValueError(f"references: {what} uses responses alone; leave one of them out")
        if self.operational and self.method is not None and self.method not in FROM_RESPONSES:
            raise ValueError(f"method {self.method} needs an excitation; for responses alone: ssi-cov, fdd, efdd")
        return self


class LevelsTable(_Spanned):
    """``[levels]``: as ``chladni levels``."""

    channels: Texts | None = None
    bands_hz: Annotated[list[Band], Field(min_length=1)] | None = None
    running_s: Positive | None = None
    machine: Literal["large-rigid", "large-flexible", "medium-rigid", "medium-flexible"] | None = None
    slow: Flag = False


class GapTable(_Spanned):
    """``[gap]``: as ``chladni gap``, each log held against a model."""

    model: Text
    leave_out: list[Text] = []
    seed: Annotated[int, Field(strict=True, ge=0)] = 0
    join: JoinName = "auto"
    state: Text | None = None
    command: Text | None = None


class OpenTable(_Table):
    """``[open]``: how logs are opened, as the options of every command."""

    stamp: Literal["auto", "header", "publish", "log"] = "auto"
    sample_rate_hz: Positive | None = None
    time: Text | None = None
    time_unit: Text | None = None
    units: dict[str, Text] | None = None
    names: Texts | None = None


class LimitTable(_Table):
    """``[[limit]]``: what a followed quantity must keep to, see docs/study.md."""

    of: Literal["level", "mode", "damping", "line"]
    channel: Text | None = None
    near_hz: Positive | None = None
    low: Number | None = None
    high: Number | None = None
    change_percent: Positive | None = None

    @model_validator(mode="after")
    def _something(self) -> Self:
        if self.low is None and self.high is None and self.change_percent is None:
            raise ValueError("needs low, high or change_percent: what the value must keep to")
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise ValueError(f"low {self.low:g} must be below high {self.high:g}")
        if self.of in ("mode", "damping", "line") and self.near_hz is None:
            raise ValueError(f"needs near_hz: which {self.of} is meant")
        if self.of in ("level", "line") and self.channel is None:
            raise ValueError(f"needs channel: whose {self.of} is meant")
        return self


class TrendTable(_Table):
    """``[trend]``: how modes, levels and lines are followed over logs."""

    covariates: list[Text] = []
    least_mac: Annotated[float, Field(strict=True, gt=0, le=1)] = 0.7
    widest_percent: Annotated[float, Field(strict=True, gt=0, le=50)] = 10.0


class RecipeFile(_Table):
    """The whole file."""

    format: Literal["chladni.study/1"]
    setup: Text | None = None
    documents: Flag = False
    open: OpenTable = OpenTable()
    info: InfoTable | None = None
    psd: PsdTable | None = None
    frf: FrfTable | None = None
    modes: ModesTable | None = None
    levels: LevelsTable | None = None
    gap: GapTable | None = None
    trend: TrendTable = TrendTable()
    limit: list[LimitTable] = []

    @model_validator(mode="after")
    def _something_to_do(self) -> Self:
        if not any((self.info, self.psd, self.frf, self.modes, self.levels, self.gap)):
            raise ValueError("asks for nothing; add a table of [info], [psd], [frf], [modes], [levels] or [gap]")
        return self
