"""Turn sweeps into tasks: one task follows one packing through one sweep, and becomes one file.

The name of a task is a hash of everything its result depends on: the parameters of the sweep that matter for it, n, the
seed, the defaults of the LAMMPS decks, and the versions of the file schema, of the protocols and of the definitions
(below). The name of the sweep, and where or how fast the task runs, do not enter. So a campaign may be renamed,
sweeps may share tasks, and more seeds add tasks without touching existing ones.

Tasks that differ only in what they measure share the first half of their names, the hash of the other parameters. So a
new observable makes a new task, but no new packings: a finished task of the same first half holds them.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Annotated, Any, Self

from pydantic import PlainSerializer, PlainValidator, SerializeAsAny, field_validator

from jamlab.campaign.file import CampaignTable, Compression, Sweep
from jamlab.campaign.keys import usual
from jamlab.campaign.observable import FileTable, Observable
from jamlab.campaign.observables import OBSERVABLES
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.flow import flow_curve, oscillate
from jamlab.geometry import contact_network, packing_fraction, particle_shape
from jamlab.geometry.voids import voids
from jamlab.mechanics.elasticity import MODULI_DEFINITION
from jamlab.mechanics.nonaffine_response import NONAFFINE_DEFINITION
from jamlab.packing.kinds import MODELS, optional_parameters
from jamlab.packing.quantities import COLUMNS
from jamlab.packing.recipe import Recipe
from jamlab.protocols import decompression, relaxation, size_distributions
from jamlab.protocols.make import CHANGE_VERSIONS
from jamlab.protocols.makings import making_of
from jamlab.rheology import complex_modulus, displacement_correlation, mode_character
from jamlab.storage.verified_file import SCHEMA_VERSION

# A module that owns a protocol or a definition holds its version, a whole number. Whoever changes what it gives, for
# the same parameters and beyond rounding, raises it by one: packings of its model are made again, or all stored
# packings measured again.


def protocol_versions(model: str, changes: Iterable[str] = ()) -> str:
    """Versions of the protocols that make packings of a model, such as "onset=5; compression=4; ...". `changes`: names
    of those that are done to them."""
    making = making_of(model)
    versions = {
        "onset": making.version,
        "stiffening": making.stiffening_version,
        "compression": making.compression_version,
        "pressure": decompression.PRESSURE_PROTOCOL,
        "quench": relaxation.QUENCH_PROTOCOL,
        "sizes": size_distributions.SIZES_PROTOCOL,
    }
    return _as_text(versions | {name: version for name, version in CHANGE_VERSIONS.items() if name in changes})


def definition_versions() -> str:
    """Versions of the definitions of what is measured."""
    versions = {
        "contacts": contact_network.CONTACTS_DEFINITION,
        "packing fraction": packing_fraction.FRACTION_DEFINITION,
        "shapes": particle_shape.SHAPE_DEFINITION,
        "voids": voids.VOIDS_DEFINITION,
        "moduli": MODULI_DEFINITION,
        "slow shear": NONAFFINE_DEFINITION,
        "spectra": complex_modulus.SPECTRUM_DEFINITION,
        "correlation": displacement_correlation.CORRELATION_DEFINITION,
        "modes": mode_character.MODES_DEFINITION,
        "flow": flow_curve.FLOW_DEFINITION,
        "oscillation": oscillate.OSCILLATION_DEFINITION,
    }
    return _as_text(versions)


def _as_text(versions: Mapping[str, int]) -> str:
    return "; ".join(f"{name}={version}" for name, version in versions.items())


TASK_VERSION = 4  # of the groups in a task file and the meaning of the parameters
_HALF = 16  # hexadecimal digits of a name for the packings, and as many for what is measured of them


def _recipe_of(value: Any) -> Recipe:
    return value if isinstance(value, Recipe) else Recipe(**value)


class Parameters(FileTable):
    """Everything that the result of a task depends on."""

    # how the first packing is made: at onset, at the highest pressure or the lowest phi; in a batch of its first task
    recipe: Annotated[Recipe, PlainValidator(_recipe_of), PlainSerializer(Recipe.entry)]
    # law, decks: of the particles and of the search for onset, defaults of the decks included
    law: dict[str, float | str]
    decks: dict[str, float | str]
    observables: dict[str, SerializeAsAny[Observable]]  # of jamlab's own, beside "states"
    own: tuple[str, ...]  # those that are functions of the user's own, module:function, or names of other packages
    # compress, pressures, phi: what is made beside it, and of itself; without any of them, only the packing at onset
    compress: Compression | None
    pressures: tuple[float, ...] | None
    phi: tuple[float, ...] | None
    decompress: bool  # whether each pressure is reached from the one above
    protocol: str  # `protocol_versions`
    definitions: str  # `definition_versions`

    @field_validator("observables", mode="before")
    @classmethod
    def _by_name(cls, value: dict[str, Any]) -> dict[str, Any]:
        if unknown := value.keys() - OBSERVABLES.keys():
            raise ValueError(f"unknown observable {', '.join(sorted(unknown))}")
        return {name: OBSERVABLES[name].model_validate(keys) for name, keys in value.items()}

    @property
    def model(self) -> str:
        """Name of the model."""
        return self.recipe.model

    @property
    def n(self) -> int:
        """Number of particles."""
        return self.recipe.n

    @property
    def ensemble(self) -> str:
        """ "fixed-box" or "shear-stabilized"."""
        return self.recipe.ensemble

    @property
    def seed(self) -> int:
        """Seed of the random start."""
        return self.recipe.seed

    @property
    def sizes(self) -> str:
        """What says the sizes of its particles, as text; "" for the usual two sizes."""
        if self.recipe.sizes is not None:
            return str(self.recipe.sizes)
        two = {name: getattr(self.recipe, name) for name in ("size_ratio", "fraction_large")}
        return ", ".join(f"{name} = {value:g}" for name, value in two.items() if value != usual(name))

    def with_seed(self, seed: int) -> Self:
        """The same of another seed."""
        return self.model_copy(update={"recipe": replace(self.recipe, seed=seed)})

    @property
    def label(self) -> str:
        """Model, n and seed, as text to show."""
        return f"{self.model} n={self.n} seed={self.seed}"

    @property
    def from_onset(self) -> bool:
        """Whether the first packing is at onset."""
        return self.recipe.protocol == "onset"


@dataclass(frozen=True)
class Task:
    """One packing through one sweep."""

    name: str  # hash of the parameters, 32 hexadecimal digits: 16 of the packings, 16 of what is measured
    parameters: Parameters  # everything the result depends on
    ranks: int = 1  # threads that it may use; they change rounding only


@dataclass(frozen=True)
class Batch:
    """The tasks of one sweep, model and n, which differ only by the seed."""

    sweep: str  # name of the sweep
    parameters: Parameters  # of the first task; other tasks differ in the seed
    seeds: list[int] | range  # one for each task
    ranks: int = 1  # threads of each task
    chunk: int | None = None  # tasks that a worker gets in one call, and writes to one file; None: see `chunks.py`

    @property
    def name(self) -> str:
        """Sweep, model and n, as text to show: no other batch of the campaign has it."""
        return f"{self.sweep}: {self.parameters.model} n={self.parameters.n}"

    def tasks(self) -> Iterator[Task]:
        """Yield the tasks."""
        for seed in self.seeds:
            yield self.task(seed)

    def task(self, seed: int) -> Task:
        """The task of one seed."""
        return Task(self.name_of(seed), self.parameters.with_seed(seed), self.ranks)

    def names(self) -> Iterator[str]:
        """Yield the names of the tasks."""
        return map(self.name_of, self.seeds)

    def name_of(self, seed: int) -> str:
        """Name the task of one seed."""
        packings, measured = self._digests
        digest = packings.copy()
        digest.update(b'"seed":%d' % seed)
        return digest.hexdigest()[:_HALF] + measured

    def first(self, count: int) -> "Batch":
        """Return the batch of the first `count` seeds."""
        return self.part(self.seeds[:count])

    def part(self, seeds: list[int] | range) -> "Batch":
        """Return the batch of some of the seeds: a chunk, which a worker runs in one call."""
        part = replace(self, seeds=seeds)
        vars(part)["_digests"] = self._digests  # which take longer than a name
        return part

    def __getstate__(self) -> dict[str, Any]:
        """What is sent to a worker: the parameters once, and the seeds; digests cannot be pickled."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def packings_key(self) -> str:
        """A hash that batches share if tasks of the same seed have the same packings."""
        return self._digests[0].hexdigest()

    @property
    def key(self) -> str:
        """A hash that batches share if their tasks of the same seed are the same."""
        return self.packings_key + self._digests[1]

    @cached_property
    def _digests(self) -> "tuple[hashlib._Hash, str]":
        """Of what makes the packings but the seed, and of what is measured."""
        record = self.parameters.model_dump(mode="json")
        del record["recipe"]["seed"]
        measured = [record.pop(key) for key in ("observables", "own", "definitions")]
        parts = ([SCHEMA_VERSION, TASK_VERSION, record], [*measured, *COLUMNS])
        packings, what = (json.dumps(part, sort_keys=True, separators=(",", ":")).encode() for part in parts)
        return hashlib.sha256(packings), hashlib.sha256(what).hexdigest()[:_HALF]


def is_task_name(text: str) -> bool:
    """Whether a task may have this name."""
    return len(text) == 2 * _HALF and set(text) <= set("0123456789abcdef")


def states_name(task: str) -> str:
    """The part of the name of a task that tasks share which differ only in what they measure."""
    return task[:_HALF]


def task_names(chosen: Iterable[Batch]) -> set[str]:
    """Names of the tasks of some batches; one that batches share is one."""
    return {name for batch in chosen for name in batch.names()}


def seeds_before(chosen: Sequence[Batch]) -> list[Container[int]]:
    """Return for each batch the seeds whose tasks a batch before it has too."""
    shared = {key: set[int]() for key, count in Counter(batch.key for batch in chosen).items() if count > 1}
    found: list[Container[int]] = []
    for batch in chosen:
        known = shared.get(batch.key, frozenset[int]())
        found.append(frozenset(known))
        if batch.key in shared:
            shared[batch.key].update(batch.seeds)
    return found


def tasks_named(chosen: Iterable[Batch], names: set[str]) -> Iterator[Task]:
    """Yield the tasks of some batches that have one of these names, each once."""
    left = set(names)
    for batch in chosen:
        for seed, name in zip(batch.seeds, batch.names(), strict=True):
            if name in left:
                left.remove(name)
                yield batch.task(seed)


def batches(campaign: CampaignTable, only: Iterable[str] | None = None) -> list[Batch]:
    """List all tasks of a campaign, or of some sweeps, in the order of its file."""
    names = [sweep.name for sweep in campaign.sweep]
    for name in only or ():
        if name not in names:
            raise InputError(f"campaign {campaign.name} has no sweep {name!r}: use one of {', '.join(names)}")
    chosen = [sweep for sweep in campaign.sweep if not only or sweep.name in only]
    return [
        Batch(sweep.name, _parameters(sweep, name, n), sweep.seeds, sweep.ranks, sweep.chunk)
        for sweep in chosen
        for name in sweep.model
        for n in sweep.n
    ]


def _parameters(sweep: Sweep, model: str, n: int) -> Parameters:
    usual = {name: each.default for name, each in optional_parameters(model, sweep.law).items()}
    kind = MODELS.get(model)  # of a named law, parameters of other laws in the deck say nothing
    foreign = kind.parameters(None, {}).keys() - kind.parameters(None, sweep.law).keys()
    law = {
        name: value
        for name, value in (defaults(model) | sweep.law).items()
        # the protocol sets `units`, `longest_edge` affects speed only, and what has its default is left to the law
        if name not in {"units", "longest_edge", *foreign} and usual.get(name) != value
    }
    decks, recipe = defaults("onset"), sweep.recipe(model, n)
    decks.pop("increment_least")  # says when to give up, not what comes out
    return Parameters(
        recipe=recipe,
        law=law,
        decks=decks,
        observables={observable.name: observable for observable in sweep.measured},
        own=tuple(sweep.own),
        compress=sweep.compress,
        pressures=None if sweep.pressures is None else tuple(sweep.pressures),
        phi=None if sweep.phi is None else tuple(sweep.phi),
        decompress=sweep.decompress,
        protocol=protocol_versions(model, {name for name, _ in recipe.changes}),
        definitions=definition_versions(),
    )
