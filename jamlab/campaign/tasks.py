"""Turn sweeps into tasks: one task follows one packing through one sweep, and becomes one file.

The name of a task is a hash of everything its result depends on: the parameters of the sweep that matter for it, n, the
seed, the defaults of the LAMMPS decks, and the versions of the file schema, of the protocols and of the definitions
(below). The name of the sweep, and where or how fast the task runs, do not enter. So a campaign may be renamed,
sweeps may share tasks, and more seeds add tasks without touching existing ones.

Tasks that differ only in what they measure share a state key, the hash of the other parameters. So a new observable
makes a new task, but no new packings: `states.py` finds a finished task of the same key.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from pydantic import Field, SerializeAsAny, field_validator

from jamlab.campaign.file import STATES, CampaignTable, Compression, Sweep
from jamlab.campaign.observable import FileTable, Observable, Tolerances
from jamlab.campaign.observables import OBSERVABLES, Onset
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.flow import creep, flow_curve, oscillate
from jamlab.geometry import contact_network, hexatic_order, packing_fraction, particle_shape
from jamlab.geometry.voids import voids
from jamlab.mechanics import elasticity, nonaffine_response
from jamlab.models.models import MODELS, optional_parameters
from jamlab.protocols import compression, onset, relaxation, size_distributions, target_pressure
from jamlab.rheology import complex_modulus, displacement_correlation, mode_character
from jamlab.storage.verified_file import SCHEMA_VERSION

# A module that owns a protocol or a definition holds its version, a whole number. Whoever changes what it gives, for
# the same parameters and beyond rounding, raises it by one: tasks are made again, or measured again on stored packings.
FIRST = 1  # version of what was stored before versions were
STATES_BY = ("contacts", "packing fraction", "shapes", "voids", "moduli")  # definitions of the columns of "states"
Versions = dict[str, int]  # name -> version, of those above 1


def _today() -> dict[str, int]:
    """Versions of the protocols, then of the definitions."""
    models = [(model.particles, model.particles) for model in MODELS.values()]
    return {
        **{f"onset of {particles}": onset.ONSET_PROTOCOL[name] for name, particles in models},
        "onset of stiffening disks": onset.ONSET_PROTOCOL["stiffening"],
        **{f"compression of {particles}": compression.COMPRESSION_PROTOCOL[name] for name, particles in models},
        "pressure": target_pressure.PRESSURE_PROTOCOL,
        "quench": relaxation.QUENCH_PROTOCOL,
        "sizes": size_distributions.SIZES_PROTOCOL,
        "contacts": contact_network.CONTACTS_DEFINITION,
        "packing fraction": packing_fraction.FRACTION_DEFINITION,
        "shapes": particle_shape.SHAPE_DEFINITION,
        "voids": voids.VOIDS_DEFINITION,
        "order": hexatic_order.ORDER_DEFINITION,
        "moduli": elasticity.MODULI_DEFINITION,
        "slow shear": nonaffine_response.NONAFFINE_DEFINITION,
        "spectra": complex_modulus.SPECTRUM_DEFINITION,
        "correlation": displacement_correlation.CORRELATION_DEFINITION,
        "modes": mode_character.MODES_DEFINITION,
        "flow": flow_curve.FLOW_DEFINITION,
        "oscillation": oscillate.OSCILLATION_DEFINITION,
        "creep": creep.CREEP_DEFINITION,
    }


def raised(names: Iterable[str]) -> Versions:
    """Current versions of protocols and definitions, if above 1."""
    today = _today()
    return {name: today[name] for name in sorted(names) if today[name] != FIRST}


def as_column(names: Iterable[str], versions: Mapping[str, int]) -> str:
    """Versions as the value of a column, such as "contacts=2; moduli=1"."""
    return "; ".join(f"{name}={versions.get(name, FIRST)}" for name in sorted(names))


TASK_VERSION = 2  # of the groups in a task file and the meaning of the parameters
_NAME_LENGTH = 32  # hexadecimal digits: 128 bits, so that no two tasks share a name


class Parameters(FileTable):
    """Everything that the result of a task depends on."""

    model: str  # "sp" or "dp"
    n: int  # number of particles
    ensemble: str  # "fixed-box" or "shear-stabilized"
    # force_law, search: of the particles and of the search for onset, defaults of the decks included
    force_law: dict[str, float | str]
    search: dict[str, float | str]
    tolerances: Tolerances  # of the sweep
    seed: int  # of the random start; in a batch that of its first task
    observables: dict[str, SerializeAsAny[Observable]]  # of jamlab's own, beside "states"
    own: tuple[str, ...]  # those that are functions of the user's own, as module:function
    # compress, pressures, phi: how packings are made; without any of them, only those at onset
    compress: Compression | None
    pressures: tuple[float, ...] | None
    phi: tuple[float, ...] | None
    sizes: str | tuple[float, ...] | None  # a distribution by name, or diameters; None: half of the particles are large
    decompress: bool  # whether each pressure is reached from the one above
    # versions of the protocols that make the packings and of the definitions of what is measured, those above 1
    protocol: Versions = Field(default={})
    definitions: Versions = Field(default={})

    @field_validator("observables", mode="before")
    @classmethod
    def _by_name(cls, value: dict[str, Any]) -> dict[str, Any]:
        if unknown := value.keys() - OBSERVABLES.keys():
            raise ValueError(f"no observable {', '.join(sorted(unknown))}")
        return {name: OBSERVABLES[name].model_validate(keys) for name, keys in value.items()}

    @property
    def protocol_names(self) -> list[str]:
        """Protocols that the packings depend on, as `versions.py` names them."""
        names = ["sizes"] if isinstance(self.sizes, str) else []
        if self.pressures is not None:
            return [*names, "pressure"]
        if self.phi is not None:
            return [*names, "quench"]
        particles = MODELS[self.model].particles
        stiffening = "stiffening " if self.force_law.get("exponent", 2.0) != 2 else ""  # of disks alone
        made = [f"onset of {stiffening}{particles}"]
        return [*names, *made, *([f"compression of {particles}"] if self.compress is not None else [])]

    def definition_names(self, table: str) -> tuple[str, ...]:
        """Definitions that a table depends on, as `versions.py` names them."""
        return next((o.defined_by for o in self.tables if o.name == table), STATES_BY)

    def now(self) -> "Parameters":
        """The same with the current versions."""
        defined = {name for table in (STATES, *(o.name for o in self.tables)) for name in self.definition_names(table)}
        return self.model_copy(update={"protocol": raised(self.protocol_names), "definitions": raised(defined)})

    @property
    def label(self) -> str:
        """Model, n and seed, as text to show."""
        return f"{self.model} n={self.n} seed={self.seed}"

    @property
    def tables(self) -> list[Observable]:
        """Observables of which a task file holds a table."""
        from_onset = self.pressures is None and self.phi is None
        return [*([Onset()] if from_onset else []), *self.observables.values()]


@dataclass(frozen=True)
class Task:
    """One packing through one sweep."""

    name: str  # hash of the parameters, 32 hexadecimal digits
    parameters: Parameters  # everything the result depends on
    ranks: int = 1  # threads that it may use; they change rounding only


@dataclass(frozen=True)
class Batch:
    """The tasks of one sweep, model and n, which differ only by the seed."""

    sweep: str  # name of the sweep
    parameters: Parameters  # of the first task; other tasks differ in the seed
    seeds: list[int] | range  # one for each task
    # column -> standard error at which no more seeds are added; empty: all seeds are wanted
    until: dict[str, float] = field(default_factory=dict)
    ranks: int = 1  # threads of each task

    @property
    def who(self) -> tuple[str, str, int]:
        """Sweep, model and n."""
        return self.sweep, self.parameters.model, self.parameters.n

    def tasks(self) -> Iterator[Task]:
        """Yield the tasks."""
        for seed in self.seeds:
            yield Task(self.name_of(seed), self.parameters.model_copy(update={"seed": seed}), self.ranks)

    def names(self) -> Iterator[str]:
        """Yield the names of the tasks."""
        return map(self.name_of, self.seeds)

    def name_of(self, seed: int) -> str:
        """Name the task of one seed."""
        return _finish(self._digest, seed)

    def first(self, count: int) -> "Batch":
        """Return the batch of the first `count` seeds."""
        return replace(self, seeds=self.seeds[:count])

    @cached_property
    def _digest(self) -> "hashlib._Hash":
        return _start(self.parameters)


def task_name(parameters: Parameters) -> str:
    """Name the task with these parameters."""
    return _finish(_start(parameters), parameters.seed)


_MEASURED: Any = {"observables": True, "own": True, "definitions": True, "tolerances": {"spectrum_error"}}


def state_key(parameters: Parameters) -> str:
    """Name the states of a task; tasks that differ only in what they measure share it."""
    return _finish(_start(parameters, _MEASURED), parameters.seed)


def _start(parameters: Parameters, exclude: Any = None) -> "hashlib._Hash":
    record = parameters.model_dump(mode="json", exclude=exclude)
    del record["seed"]
    text = json.dumps([SCHEMA_VERSION, TASK_VERSION, record], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode())


def _finish(digest: "hashlib._Hash", seed: int) -> str:
    digest = digest.copy()
    digest.update(f'"seed":{seed}'.encode())
    return digest.hexdigest()[:_NAME_LENGTH]


def task_names(chosen: Iterable[Batch]) -> set[str]:
    """Names of the tasks of some batches; one that batches share is one."""
    return {name for batch in chosen for name in batch.names()}


def batches(campaign: CampaignTable, only: Iterable[str] | None = None) -> list[Batch]:
    """List all tasks of a campaign, or of some sweeps, in the order of its file."""
    names = [sweep.name for sweep in campaign.sweep]
    for name in only or ():
        if name not in names:
            raise InputError(f"campaign {campaign.name} has no sweep {name!r}: use one of {', '.join(names)}")
    chosen = [sweep for sweep in campaign.sweep if not only or sweep.name in only]
    return [
        Batch(sweep.name, _parameters(sweep, name, n), sweep.seeds, sweep.until or {}, sweep.ranks)
        for sweep in chosen
        for name in sweep.model
        for n in sweep.n
    ]


def _parameters(sweep: Sweep, model: str, n: int) -> Parameters:
    usual = {name: each.default for name, each in optional_parameters(model).items()}
    law = {
        name: value
        for name, value in (defaults(model) | sweep.force_law).items()
        # the protocol sets `law`, `longest_edge` affects speed only, and what has its default is left to the law
        if name not in ("law", "longest_edge") and usual.get(name) != value
    }
    search = defaults("onset")
    search.pop("increment_least")  # says when to give up, not what comes out
    sizes = sweep.sizes
    return Parameters(
        model=model,
        n=n,
        ensemble=sweep.ensemble,
        force_law=law,
        search=search,
        tolerances=sweep.tolerances,
        seed=sweep.seeds[0],
        observables={observable.name: observable for observable in sweep.measured},
        own=tuple(sweep.own),
        compress=sweep.compress,
        pressures=None if sweep.pressures is None else tuple(sorted(map(float, sweep.pressures), reverse=True)),
        phi=None if sweep.phi is None else tuple(sorted(map(float, sweep.phi))),
        sizes=tuple(sizes) if isinstance(sizes, list) else sizes,
        decompress=sweep.decompress,
    ).now()
