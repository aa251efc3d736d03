"""Read a campaign file: TOML with one or more sweeps, checked key by key before anything runs.

    name = "first"

    [[sweep]]
    name = "disks"
    model = "sp"
    n = [32, 64]
    seeds = 10
    compress = { to = 0.95, step = 0.01, first_step = 1e-4 }

`starter.toml` and `reference.toml` show more keys; `Sweep` lists the keys of every sweep, and the classes of
`observables.py` the keys of each observable. Each wrong key is one line of the error: its place, its value, and what
pydantic says about it.
"""

import os
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    ValidationError,
    create_model,
    field_validator,
    model_serializer,
    model_validator,
)

from jamlab.arguments.choices import By, Ensemble, Registered, Search, Start, Units
from jamlab.campaign.keys import usual, within
from jamlab.campaign.observable import (
    DECLARED,
    FileTable,
    LogGrid,
    Observable,
    OneOrMore,
    ascending,
    descending,
    distinct,
)
from jamlab.campaign.observables import OBSERVABLES
from jamlab.campaign.wrong_keys import explain
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.laws.laws import parameters_of
from jamlab.models.disks import DISKS
from jamlab.packing.kinds import MODELS, optional_parameters
from jamlab.packing.model import Model
from jamlab.packing.quantities import QUANTITIES
from jamlab.packing.recipe import Recipe


@dataclass(frozen=True)
class CampaignLimits:
    """Limits, so that nonsense is named at once instead of filling memory and time."""

    tasks: int = 1_000_000  # of a campaign: files in one folder, and names that `status` compares
    sizes: int = 1_000  # of a sweep: each is a line of `plan` and `status`
    states: int = 100_000  # of a compression, which are all kept in memory


LIMITS = CampaignLimits()


STATES = "states"  # the observable of every task: what `jamlab.measure` says of its states
_NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]*$"


_DENSITY = ("dos", "vdos", "density_of_states")  # observables typed from habit, and the functions of Python
_MEANT = {
    **dict.fromkeys(("gstar", "complex_modulus", "spectrum", "moduli"), "spectra"),
    **{"flow_curve": "flow", "shear": "flow", "oscillate": "oscillation", "measure": STATES, "hexatic_order": "order"},
}


def _check_observable(value: str) -> str:
    declared = DECLARED.names()
    function = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*", re.ASCII)
    if value not in (STATES, *OBSERVABLES, *declared) and not function.fullmatch(value):
        known = ", ".join(map(repr, (STATES, *OBSERVABLES, *declared)))
        if value in _DENSITY:
            raise ValueError("use jamlab.density_of_states(campaign) of the packings: it needs no observable")
        if value in _MEANT:
            raise ValueError(f"use {_MEANT[value]!r}, or another of {known}")
        said = f"use one of {known}, or 'module:function' for a function of your own"
        column = f"; {value.lower()} is a column of the table {STATES!r} of every sweep"
        raise ValueError(said + column * (value.lower() in QUANTITIES))
    return value


def _check_model(value: str) -> str:
    MODELS.get(value)  # refuses one that is unknown
    return value


class Compression(FileTable):
    """Arguments of `jamlab.compress`, from onset up to a packing fraction, or to a distance above each onset. With
    `confluence`, the packing fraction at which z reaches 6 is bisected to that error (`bisect_confluence`)."""

    # exactly one of these
    to: Annotated[float, within("to")] | None = None
    above_onset: Annotated[float, within("above_onset")] | None = None
    by: By = usual("by", "compress")
    step: Annotated[float, within("step", "compress")] = usual("step", "sweep.compress")
    first_step: Annotated[float, within("first_step")] | None = None
    per_decade: Annotated[int, within("per_decade"), Field(default_factory=lambda: usual("per_decade"))]
    pressure_tolerance: Annotated[float, within("pressure_tolerance")] | None = None
    confluence: Annotated[float, within("confluence")] | None = None

    @model_validator(mode="after")
    def _check_steps(self) -> "Compression":
        if (self.to is None) == (self.above_onset is None):
            said = "is missing" if self.to is None else "and above_onset are given"
            raise ValueError(f"to {said}: give to, a packing fraction, or above_onset, a distance from each onset")
        if self.by == "rho" and self.to is not None and self.to > 1:
            raise ValueError(f"to = {self.to:g} is above 1, the highest rho there is: lower it, or set by = 'phi'")
        if self.first_step is not None and self.first_step > self.step:
            raise ValueError(f"first_step = {self.first_step:g} is above step = {self.step:g}: lower it")
        if self.first_step is None and self.per_decade != usual("per_decade"):
            said = f"per_decade = {self.per_decade}: it spaces the states after first_step"
            raise ValueError(f"{said}; give first_step too")
        if (way := self.to or self.above_onset or 0.0) > LIMITS.states * self.step:
            least = f"use {way / LIMITS.states:.1g} or more"
            raise ValueError(f"step = {self.step:g}: {way / self.step:.1g} states up to {way:g}; {least}")
        return self

    @model_serializer(mode="wrap")
    def _only_what_is_given(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Without `above_onset` where `to` is given: names of tasks come from what is written here."""
        written: dict[str, Any] = dump(self)
        if self.above_onset is None:
            del written["above_onset"]
        return written


class SeedRange(FileTable):
    """{ first, last }: seeds from the first to the last, such as those that another machine does not run."""

    first: Annotated[int, within("first")]
    last: Annotated[int, within("last")]

    @model_validator(mode="after")
    def _check_order(self) -> "SeedRange":
        if self.first > self.last:
            raise ValueError(f"first = {self.first} is above last = {self.last}: swap them")
        if self.last - self.first >= LIMITS.tasks:
            raise ValueError(
                f"{self.first} to {self.last} are too many, at most {LIMITS.tasks} tasks: give fewer seeds"
            )
        return self


class Sweep(FileTable):
    """One `[[sweep]]`; `SweepTable` adds the keys of observables, such as `omega` of "spectra". What each key means is
    said in docs/reference/campaign_files.md."""

    name: Annotated[str, Field(pattern=_NAME)]  # of the sweep, for `--only` and `table(..., sweep=...)`
    model: OneOrMore[Annotated[str, AfterValidator(_check_model)]]
    n: Annotated[OneOrMore[Annotated[int, within("n")]], Field(max_length=LIMITS.sizes)]
    seeds: list[Annotated[int, within("seed")]] | range
    # exactly one of `compress`, `pressures`, `phi` and `onset`
    compress: Compression | None = None
    pressures: Annotated[OneOrMore[float], AfterValidator(descending)] | None = None  # of disks; see `pack`
    decompress: bool = usual("decompress")
    phi: Annotated[OneOrMore[Annotated[float, within("phi")]], AfterValidator(ascending)] | None = None  # of disks
    onset: Literal[True] | None = None
    # of `jam`, which `compress` and `onset` begin with
    search: Search | None = None
    step: Annotated[float, within("step", "jam")] | None = None
    start: Start | None = None
    changes: list[Any] = Field(default=[])  # of each packing that is made from a random start; see `jamlab.make`
    units: Units | None = usual("units")
    ensemble: Ensemble = usual("ensemble")
    # of a function of the user's own, "module:function", or of another package, only the name enters names of tasks
    observables: OneOrMore[Annotated[str, AfterValidator(_check_observable)]] = Field(default=[STATES])
    # parameters that replace the defaults; in the file also the name of a law
    law: Annotated[dict[str, Any], BeforeValidator(parameters_of)] = Field(default={})
    size_ratio: Annotated[float, within("size_ratio")] | None = usual("size_ratio")
    fraction_large: Annotated[float, within("fraction_large")] = usual("fraction_large")
    sizes: str | list[float] | None = usual("sizes")  # see `jamlab.protocols.size_distributions`
    force_tolerance: Annotated[float, within("force_tolerance", "sweep")] | None = usual("force_tolerance")
    ranks: Annotated[int, within("ranks")] = usual("ranks")  # threads of each task; a worker or job holds so many cores
    chunk: Annotated[int, within("chunk")] | None = usual("chunk")  # seeds of a call and of a file; see `chunks.py`

    model_config = ConfigDict(arbitrary_types_allowed=True)

    @property
    def own(self) -> list[str]:
        """Observables that are functions of the user's own or of other packages, by name."""
        return sorted(name for name in self.observables if name != STATES and name not in OBSERVABLES)

    @property
    def measured(self) -> list[Observable]:
        """Observables of jamlab's own, with their keys, by name."""
        given = {key: value for key in type(self).model_fields if (value := getattr(self, key)) is not None}
        wanted = [OBSERVABLES[name] for name in sorted(self.observables) if name in OBSERVABLES]
        return [o(**{key: given[key] for key in o.model_fields if key in given}) for o in wanted]

    def recipe(self, model: str, n: int) -> Recipe:
        """How the first packing is made: at onset, at the highest pressure or the lowest phi, of the first seed."""
        first: dict[str, Any] = {"protocol": "onset"}
        if self.pressures is not None:
            first = {"protocol": "pressure", "pressure": self.pressures[0]}
        elif self.phi is not None:
            first = {"protocol": "phi", "phi": self.phi[0]}
        apart = {"model", "n", "phi", "ranks"}  # of which a sweep has several, or which are no part of what is made
        names = (each.name for each in fields(Recipe) if each.name in Sweep.model_fields and each.name not in apart)
        shared = {name: getattr(self, name) for name in names}
        usual_law = {each: of.default for each, of in optional_parameters(model, self.law).items()}
        usual_law = defaults(model) | usual_law
        shared["law"] = {each: value for each, value in self.law.items() if usual_law.get(each) != value}
        return Recipe(**first, **shared, model=Registered(model), n=n, seed=self.seeds[0])

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
        if value > LIMITS.tasks:
            raise ValueError(f"a campaign has at most {LIMITS.tasks} tasks: give fewer seeds")
        return range(1, value + 1)

    @field_validator("seeds")
    @classmethod
    def _refuse_repetition(cls, value: Any) -> Any:
        return distinct(value) if isinstance(value, list) else value

    @model_validator(mode="after")
    def _check_combination(self) -> "Sweep":
        protocols = [key for key in ("compress", "pressures", "phi", "onset") if getattr(self, key) is not None]
        if len(protocols) != 1:
            said = f"{' and '.join(protocols)} are given: " if protocols else ""
            raise ValueError(f"{said}give exactly one of compress, pressures, phi and onset = true")
        if self.decompress and len(self.pressures or ()) < 2:
            remedy = "leave it out" if self.pressures is None else "give two pressures or more, or leave it out"
            raise ValueError(f"decompress = true needs several pressures, from high to low: {remedy}")
        for key in ("pressures", "phi"):
            if getattr(self, key) is not None:
                self._only(lambda kind: kind.name == DISKS.name, f"{key} are", " with compress or onset")
        if False in (getattr(self, "prestress", None) or ()):
            self._only(lambda kind: not kind.needs_prestress, "prestress = false is")
        if self.ranks > 1:
            self._only(lambda kind: kind.compiled_fire, f"ranks = {self.ranks} is")
        self._check_packings()
        self._check_observables()
        return self

    def _only(self, holds: Callable[[Model[Any]], bool], what: str, instead: str = "") -> None:
        """Refuse keys of some models in a sweep of another model; `instead`: what such a sweep has in their place."""
        for other in self.model:
            if not holds(MODELS.get(other)):
                model = ", ".join(name for name, kind in MODELS.each().items() if holds(kind))
                particles = MODELS.get(other).particles
                raise ValueError(f"{what} for model {model} only: give {particles} a separate sweep{instead}")

    def _check_packings(self) -> None:
        """Refuse a force law and sizes that no packing can have; InputError is a ValueError."""
        from jamlab.protocols.make import check_recipe
        from jamlab.protocols.size_distributions import FROM_FILE

        if isinstance(self.sizes, str) and self.sizes.startswith(FROM_FILE):
            raise ValueError(f"sizes = {self.sizes!r}: write the diameters as a list, since files may change")
        for name in self.model:
            for n in self.n:
                check_recipe(self.recipe(name, n))
        for pressure in self.pressures or ():
            check_recipe(replace(self.recipe(self.model[0], self.n[0]), pressure=pressure))

    def _check_observables(self) -> None:
        for name, observable in OBSERVABLES.items():
            for key, field in observable.model_fields.items():
                users = [other for other, wanted in OBSERVABLES.items() if key in wanted.model_fields]
                if getattr(self, key) is not None and not {*users} & {*self.observables}:
                    said = f"{key} is given, but no observable that uses it"
                    raise ValueError(f"{said}: add {' or '.join(map(repr, users))}, or leave {key} out")
                if field.is_required() and getattr(self, key) is None and name in self.observables:
                    raise ValueError(f"observable {name!r} needs {key}: give {observable.needs}")
            if name in self.observables:
                self._only(observable.serves, f"observable {name!r} is")
        laws = {each: defaults(each) | self.law for each in self.model}
        for wanted in self.measured:
            wanted.check(max(site_count(n, model, law) for n in self.n for model, law in laws.items()))


def site_count(n: int, model: str, law: Mapping[str, Any]) -> float:
    """Count the sites of n particles, of droplets the vertices, in the mean of the two sizes."""
    if (each := MODELS.get(model).sites) is not None:
        return n * each
    counts = [int(law[name]) for name in ("nv_small", "nv_large") if name in law]
    return n * sum(counts) / 2 if counts else n


def _sweep_table() -> type[Sweep]:
    """Sweeps with the keys of all observables; a key that several have is one and the same."""
    keys: dict[str, Any] = {}
    for observable in OBSERVABLES.values():
        for key, field in observable.model_fields.items():
            kind: Any = field.annotation
            keys[key] = ((Annotated[(kind, *field.metadata)] if field.metadata else kind) | None, None)
    return create_model("SweepTable", __base__=Sweep, **keys)


SweepTable = _sweep_table()
_SweepWithKeys = SerializeAsAny[Annotated[Sweep, BeforeValidator(SweepTable.model_validate)]]


class CampaignTable(FileTable):
    """A whole file."""

    name: Annotated[str, Field(pattern=_NAME)]  # of the campaign, and of its folder
    sweep: Annotated[list[_SweepWithKeys], Field(min_length=1)]  # one or more sweeps

    @field_validator("sweep")
    @classmethod
    def _check_names(cls, value: list[Sweep]) -> list[Sweep]:
        names = [sweep.name for sweep in value]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two sweeps have the name {name!r}: rename one")
        tasks = sum(len(sweep.model) * len(sweep.n) * len(sweep.seeds) for sweep in value)
        if tasks > LIMITS.tasks:
            raise ValueError(f"{tasks} tasks, but a campaign has at most {LIMITS.tasks}: give fewer seeds, or split it")
        return value


# tables by the key that holds them, where the annotation shows what they are turned into
_PLAIN: dict[str, type[FileTable]] = {
    "sweep": SweepTable,
    "seeds": SeedRange,
    **dict.fromkeys(("omega", "correlation_omega", "rates", "amplitudes"), LogGrid),
}


def check_campaign(text: str, path: str | os.PathLike[str]) -> CampaignTable:
    """Check the text of a campaign file."""
    try:
        content = tomllib.loads(text)
    except RecursionError as error:
        raise InputError(f"{path} nests brackets too deeply: write the lists of a campaign flat") from error
    except ValueError as error:  # of TOML, or an integer of more than 4300 digits
        raise InputError(f"{path} is not TOML: {error}; correct that line") from error
    try:
        return CampaignTable.model_validate(content)
    except ValidationError as error:
        found = [problem for problem in error.errors() if problem["type"] != "is_instance_of"]  # of `range`
        lines = [explain(problem, CampaignTable, _PLAIN) for problem in found]
        raise InputError("\n".join(f"{path}: {line}" for line in dict.fromkeys(lines))) from None
