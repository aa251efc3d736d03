"""What a campaign file may say: its tables, key by key, with what is refused.

    name = "first"

    [[sweep]]
    name = "disks"
    model = "sp"
    n = [32, 64]
    seeds = 10
    compress = { to = 0.95, step = 0.01, nearest = 1e-4 }

A file holds one or more sweeps. `starter.toml` and `reference.toml` show more keys; `SweepTable` lists all of them.
"""

import re
from collections import Counter
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    field_validator,
    model_validator,
)

from jamlab.campaign.file_values import FileTable, Frequencies, NotNegative, Positive
from jamlab.campaign.flow_file import FLOWS, Creeping, Flow, Oscillating
from jamlab.checks import MOST_PARTICLES
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import JamlabError
from jamlab.packing.law_parameters import OPTIONAL
from jamlab.protocols.onset import LARGEST_TOLERANCE
from jamlab.protocols.relaxation import LEAST_TOLERANCE

OBSERVABLES = ("states", "spectra", "quasistatic", "correlation", "modes", "voids", "flow", "oscillation", "creep")

# limits, so that nonsense is named at once instead of filling memory and time
MOST_TASKS = 1_000_000  # of a campaign: files in one folder, and names that `status` compares
MOST_RANKS = 1_024  # of a task: more than any one machine has cores
MOST_SIZES = 1_000  # of a sweep: each is a line of `plan` and `status`
SMALLEST_STEP = 1e-5  # of a compression, whose states are all kept in memory

_NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"
_FUNCTION = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*", re.ASCII)


class _Table(FileTable, BaseModel):
    """A table whose defaults are copied, which ruff knows of a BaseModel that it sees."""


def _make_list(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


def _check_observable(value: str) -> str:
    if value not in OBSERVABLES and not _FUNCTION.fullmatch(value):
        known = ", ".join(map(repr, OBSERVABLES))
        raise ValueError(f"use one of {known}, or 'module:function' for a function of your own")
    return value


Observable = Annotated[str, AfterValidator(_check_observable)]


class Compression(_Table):
    """Arguments of `jamlab.compress`, from onset up to a packing fraction.

    With `confluence`, the packing fraction at which z reaches 6 is bisected to that error (`bisect_confluence`).
    """

    to: Annotated[float, Field(gt=0, le=2)]
    by: Literal["rho", "phi"] = "rho"
    step: Annotated[float, Field(ge=SMALLEST_STEP, le=1)] = 0.01
    nearest: Annotated[float, Field(ge=1e-12, le=1)] | None = None
    per_decade: Annotated[int, Field(ge=1, le=1000, default_factory=lambda: int(defaults("sweep")["per_decade"]))]
    confluence: Annotated[float, Field(ge=1e-9, le=1)] | None = None

    @model_validator(mode="after")
    def _check_steps(self) -> "Compression":
        if self.by == "rho" and self.to > 1:
            raise ValueError(f"to = {self.to:g} is above 1, the highest rho there is: lower it, or set by = 'phi'")
        if self.nearest is not None and self.nearest > self.step:
            raise ValueError(f"nearest = {self.nearest:g} is above step = {self.step:g}: lower it")
        return self


class SeedRange(_Table):
    """{ first, last }: seeds from the first to the last, such as those that another machine does not run."""

    first: Annotated[int, Field(ge=0)]
    last: Annotated[int, Field(ge=0)]

    @model_validator(mode="after")
    def _check_order(self) -> "SeedRange":
        if self.first > self.last:
            raise ValueError(f"first = {self.first} is above last = {self.last}: swap them")
        if self.last - self.first >= MOST_TASKS:
            raise ValueError(f"{self.first} to {self.last} are too many, at most {MOST_TASKS} tasks: give fewer seeds")
        return self


class DampingLaws(_Table):
    """Damping laws: beta of contact damping and eta_f of Stokes drag, one spectrum for each value."""

    contact: list[NotNegative] = []
    stokes: list[NotNegative] = []


class Tolerances(_Table):
    """How well states are minimised, and from which error on results are marked as not converged."""

    max_force: Annotated[float, Field(ge=LEAST_TOLERANCE, le=LARGEST_TOLERANCE)] | None = None  # `tolerance` of `jam`
    step_error: Annotated[float, Field(gt=0, le=1)] | None = None  # `error` of `jamlab.compress`
    spectrum_error: Positive = 1e-3  # estimated relative error of G*


class SweepTable(_Table):
    """One `[[sweep]]`.

    Attributes:
        name: of the sweep, for `--only` and `table(..., sweep=...)`.
        model: "sp", "dp" or a list of both.
        n: even number of particles, or a list.
        seeds: number of seeds (1, 2, ...), a list, or { first, last }; with `until`, the most that may be used.
        until: { column = error, ... }: use no more seeds than needed for this standard error of the mean over packings
            of each named column of "states", at the last state of each packing and for each model and n. The first
            eight seeds always run; `standard_error.py` says how many follow.
        compress: from onset up to a packing fraction. Give exactly one of `compress`, `pressures`, `phi` and `onset`.
        pressures: target pressures of disks, in units of k.
        phi: packing fractions at which random disks are quenched, jammed or loose, in units of k: where flows start.
        onset: true: make only the packings at onset.
        ensemble: "fixed-box" or "shear-stabilized".
        observables: tables to measure; "states" is always among them. One added later is measured on the packings
            that are stored. "module:function" is a function of your own in a module beside the campaign file: it
            takes a `Packing` and returns a number, column `function` of "states", or a dict of numbers, whose keys
            are columns. Only its name enters the names of tasks: rename it when it changes.
        damping: laws of the spectra and of the correlation; by default balanced contact damping.
        prestress: true, false or both.
        omega: frequencies of the spectra: a list, or { lowest, highest, points } for even spacing in log omega.
        correlation_omega: frequencies of the displacement correlation.
        flow: { rates = [...], ... }: start-up and steady flow by each damping law, see `Flow`; table "flow".
        oscillation: { omega = [...], amplitudes = [...], ... }, see `Oscillating`; table "oscillation".
        creep: { stresses = [...], duration, ... }, see `Creeping`; table "creep".
        force_law: parameters of droplets that replace the defaults.
        tolerances: see `Tolerances`.
        ranks: MPI ranks of each task, which minimise large packings of disks; a worker or SLURM job of this sweep holds
            so many cores. Pays from about 10 000 disks.
    """

    name: Annotated[str, Field(pattern=_NAME)]
    model: Annotated[list[Literal["sp", "dp"]], BeforeValidator(_make_list), Field(min_length=1)]
    n: Annotated[
        list[Annotated[int, Field(ge=2, le=MOST_PARTICLES, multiple_of=2)]],
        BeforeValidator(_make_list),
        Field(min_length=1, max_length=MOST_SIZES),
    ]
    seeds: list[Annotated[int, Field(ge=0)]] | range
    until: Annotated[dict[str, Positive], Field(min_length=1)] | None = None
    compress: Compression | None = None
    pressures: Annotated[list[Annotated[float, Field(ge=1e-8, le=0.3)]], Field(min_length=1)] | None = None
    phi: Annotated[list[Annotated[float, Field(ge=0.1, le=2)]], Field(min_length=1)] | None = None
    onset: Literal[True] | None = None
    ensemble: Literal["fixed-box", "shear-stabilized"] = "fixed-box"
    observables: list[Observable] = ["states"]
    damping: DampingLaws = DampingLaws(contact=[1.0])
    prestress: Annotated[list[bool], BeforeValidator(_make_list), Field(min_length=1)] = [True]
    omega: Frequencies | None = None
    correlation_omega: Frequencies | None = None
    flow: Flow | None = None
    oscillation: Oscillating | None = None
    creep: Creeping | None = None
    force_law: dict[str, Any] = {}
    tolerances: Tolerances = Tolerances()
    ranks: Annotated[int, Field(ge=1, le=MOST_RANKS)] = 1

    model_config = ConfigDict(arbitrary_types_allowed=True)

    @field_validator("seeds", mode="before")
    @classmethod
    def _count_to_range(cls, value: Any) -> Any:
        if isinstance(value, list):
            return value
        if isinstance(value, dict):
            ends = SeedRange.model_validate(value)
            return range(ends.first, ends.last + 1)
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise ValueError("give a number of seeds (1 or more), a list of seeds, or { first = 101, last = 200 }")
        if value > MOST_TASKS:
            raise ValueError(f"a campaign has at most {MOST_TASKS} tasks: give fewer seeds")
        return range(1, value + 1)

    @field_validator("model", "n", "seeds", "pressures", "phi", "observables", "prestress")
    @classmethod
    def _refuse_repetition(cls, value: Any) -> Any:
        if isinstance(value, list):
            repeated = next((entry for entry, count in Counter(value).items() if count > 1), None)
            if repeated is not None:
                raise ValueError(f"{repeated!r} is listed twice: leave one out")
            if not value:
                raise ValueError("the list is empty: give at least one")
        return value

    @model_validator(mode="after")
    def _check_combination(self) -> "SweepTable":
        protocols = [key for key in ("compress", "pressures", "phi", "onset") if getattr(self, key) is not None]
        if len(protocols) != 1:
            said = " and ".join(protocols) or "none of them"
            raise ValueError(f"says {said}: give exactly one of compress, pressures, phi and onset = true")
        self._check_until()
        droplets = "dp" in self.model
        for key in ("pressures", "phi"):
            if droplets and getattr(self, key) is not None:
                raise ValueError(f"{key} are for model sp (units k): give droplets a separate sweep with compress")
        if self.phi is not None and self.ensemble != "fixed-box":
            raise ValueError("phi is for ensemble fixed-box: a quench keeps the box")
        if droplets and False in self.prestress:
            raise ValueError("prestress = false is for model sp: give droplets a separate sweep")
        if droplets and "quasistatic" in self.observables:
            raise ValueError("observable 'quasistatic' is for model sp: give droplets a separate sweep")
        if "modes" in self.observables:
            self._check_modes()
        if droplets and self.ranks > 1:
            raise ValueError(f"ranks = {self.ranks} is for model sp: give droplets a separate sweep with ranks = 1")
        self._check_force_law()
        laws = len(self.damping.contact) + len(self.damping.stokes)
        needs = {"spectra": "omega", "correlation": "correlation_omega"} | {name: name for name in FLOWS}
        for observable, key in needs.items():
            if observable in self.observables and getattr(self, key) is None:
                raise ValueError(f"observable {observable!r} needs {key}: give {FLOWS.get(observable, 'frequencies')}")
            if observable in self.observables and not laws:
                raise ValueError(f"observable {observable!r} needs a damping law: add contact or stokes to damping")
            if getattr(self, key) is not None and observable not in self.observables:
                raise ValueError(f"{key} is given, but observable {observable!r} is not: add it or leave {key} out")
        return self

    def _check_force_law(self) -> None:
        from jamlab.protocols.random_start import check_force_law

        of_droplets = sorted(self.force_law.keys() - OPTIONAL["sp"].keys())
        if of_droplets and "sp" in self.model:
            raise ValueError(f"{of_droplets[0]} of force_law is for model dp: give droplets a separate sweep")
        for model in self.model if self.force_law else ():
            try:
                check_force_law(model, self.force_law)
            except JamlabError as error:
                raise ValueError(f"force_law: {error}") from None

    def _check_modes(self) -> None:
        from jamlab.rheology.relaxation_spectrum import LARGEST_DENSE

        if "sp" in self.model:
            raise ValueError("observable 'modes' is for model dp: give disks a separate sweep")
        if not self.damping.contact and not self.damping.stokes:
            raise ValueError("observable 'modes' needs a damping law: add contact or stokes to damping")
        law = defaults("dp") | self.force_law
        vertices = max(self.n) // 2 * (int(law["nv_small"]) + int(law["nv_large"]))
        if 2 * vertices > LARGEST_DENSE:
            raise ValueError(
                f"observable 'modes' of {vertices} vertices: at most {LARGEST_DENSE // 2}; lower n or their vertices"
            )

    def _check_until(self) -> None:
        from jamlab.measure import COLUMNS

        for column in self.until or ():
            if column not in COLUMNS and not any(":" in observable for observable in self.observables):
                raise ValueError(f"until.{column}: table states has no such column: use one of {', '.join(COLUMNS)}")


class CampaignTable(_Table):
    """A whole file.

    Attributes:
        name: of the campaign, and of its folder.
        sweep: one or more sweeps.
        slurm: arguments of `dask_jobqueue.SLURMCluster` for `--slurm`: queue, account, walltime ("24:00:00"), memory
            ("2 GB"), job_extra_directives, job_script_prologue, ... One job runs one task at a time, on as many
            cores as its sweep has `ranks`.
    """

    name: Annotated[str, Field(pattern=_NAME)]
    sweep: Annotated[list[SweepTable], Field(min_length=1)]
    slurm: dict[str, Any] = {}

    @field_validator("sweep")
    @classmethod
    def _check_names(cls, value: list[SweepTable]) -> list[SweepTable]:
        names = [sweep.name for sweep in value]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two sweeps have the name {name!r}: rename one")
        tasks = sum(len(sweep.model) * len(sweep.n) * len(sweep.seeds) for sweep in value)
        if tasks > MOST_TASKS:
            raise ValueError(f"{tasks} tasks, but a campaign has at most {MOST_TASKS}: give fewer seeds, or split it")
        return value
