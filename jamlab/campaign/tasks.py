"""Turn sweeps into tasks: one task follows one packing through one sweep, and becomes one file.

The name of a task is a hash of everything its result depends on: the parameters of the sweep that matter for it, n, the
seed, the defaults of the LAMMPS decks, and the version of the file schema. The name of the sweep, and where or how fast
the task runs, do not enter. So a campaign may be renamed, sweeps may share tasks, and more seeds add tasks without
touching existing ones.

Tasks that differ only in what they measure share a state key, the hash of the other parameters. So a new observable
makes a new task, but no new packings: `stored_states.py` finds a finished task of the same key.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from jamlab.campaign.file_tables import CampaignTable, SweepTable
from jamlab.campaign.flow_file import FLOWS
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.packing.law_parameters import OPTIONAL
from jamlab.storage.verified_file import SCHEMA_VERSION

TASK_VERSION = 1  # of the groups in task_file.py and the meaning of the parameters
_NAME_LENGTH = 32  # hexadecimal digits: 128 bits, so that no two tasks share a name
_MEASURING = (
    "observables",
    "damping",
    "prestress",
    "omega",
    "correlation_omega",
    *FLOWS,
)  # parameters without effect on states


@dataclass(frozen=True)
class Task:
    """One packing through one sweep.

    Attributes:
        name: hash of the parameters, 32 hexadecimal digits.
        parameters: everything the result depends on, as plain numbers and text.
        ranks: MPI ranks that it may use; they change rounding only.
    """

    name: str
    parameters: dict[str, Any]
    ranks: int = 1

    @property
    def label(self) -> str:
        """Model, n and seed, as text to show."""
        return f"{self.parameters['model']} n={self.parameters['n']} seed={self.parameters['seed']}"


@dataclass(frozen=True)
class Batch:
    """The tasks of one sweep, model and n, which differ only by the seed.

    Attributes:
        sweep: name of the sweep.
        parameters: of every task, without the seed.
        seeds: one for each task.
        until: column -> standard error at which no more seeds are added; empty: all seeds are wanted.
        ranks: MPI ranks of each task.
    """

    sweep: str
    parameters: dict[str, Any]
    seeds: list[int] | range
    until: dict[str, float] = field(default_factory=dict)
    ranks: int = 1

    def tasks(self) -> Iterator[Task]:
        """Yield the tasks."""
        for seed in self.seeds:
            yield Task(self.name_of(seed), {**self.parameters, "seed": seed}, self.ranks)

    def names(self) -> Iterator[str]:
        """Yield the names of the tasks."""
        return map(self.name_of, self.seeds)

    def name_of(self, seed: int) -> str:
        """Name the task of one seed."""
        digest = self._digest.copy()
        digest.update(f'"seed":{seed}'.encode())
        return digest.hexdigest()[:_NAME_LENGTH]

    def first(self, count: int) -> "Batch":
        """Return the batch of the first `count` seeds."""
        return replace(self, seeds=self.seeds[:count])

    @cached_property
    def _digest(self) -> "hashlib._Hash":
        return hashlib.sha256(json.dumps(self.parameters, sort_keys=True, separators=(",", ":")).encode())


def task_name(parameters: dict[str, Any]) -> str:
    """Name the task with these parameters, which include the seed."""
    rest = {key: value for key, value in parameters.items() if key != "seed"}
    return Batch("", rest, []).name_of(parameters["seed"])


def state_key(parameters: dict[str, Any]) -> str:
    """Name the states of the task with these parameters; tasks that differ only in what they measure share it."""
    rest = {key: value for key, value in parameters.items() if key not in _MEASURING}
    rest["tolerances"] = {k: v for k, v in parameters["tolerances"].items() if k != "spectrum_error"}
    return task_name(rest)


def batches(campaign: CampaignTable, only: Iterable[str] | None = None) -> list[Batch]:
    """List all tasks of a campaign, in the order of its file.

    Args:
        campaign: content of the file.
        only: names of sweeps to keep; by default all.

    Raises:
        InputError: the campaign has no sweep of that name.
    """
    names = [sweep.name for sweep in campaign.sweep]
    for name in only or ():
        if name not in names:
            raise InputError(f"campaign {campaign.name} has no sweep {name!r}: use one of {', '.join(names)}")
    chosen = [sweep for sweep in campaign.sweep if not only or sweep.name in only]
    return [
        Batch(sweep.name, _parameters(sweep, model, n), sweep.seeds, sweep.until or {}, sweep.ranks)
        for sweep in chosen
        for model in sweep.model
        for n in sweep.n
    ]


def _parameters(sweep: SweepTable, model: str, n: int) -> dict[str, Any]:
    law = {**defaults(model), **{key: _plain(value) for key, value in sweep.force_law.items()}}
    law.pop("law", None)  # set by the protocol
    law.pop("longest_edge", None)  # affects speed only
    for name, (default, *_) in OPTIONAL[model].items():
        if law.get(name) == default:
            law.pop(name)  # tasks keep the names that they had before the law had this parameter
    search = defaults("onset")
    search.pop("increment_least")  # says when to give up, not what comes out
    parameters: dict[str, Any] = {
        "version": [SCHEMA_VERSION, TASK_VERSION],
        "model": model,
        "n": n,
        "ensemble": sweep.ensemble,
        "observables": sorted({"states", *sweep.observables}),
        "force_law": law,
        "search": search,
        "tolerances": sweep.tolerances.model_dump(),
    }
    if sweep.tolerances.max_force is not None:
        parameters["minimized_to"] = sweep.tolerances.max_force  # jamlab 0.1.0 only marked states by it
    if sweep.compress is not None:
        parameters["compress"] = sweep.compress.model_dump()
        if sweep.compress.confluence is None:
            del parameters["compress"]["confluence"]  # tasks keep the names that they had before there was the key
    elif sweep.pressures is not None:
        parameters["pressures"] = sorted(map(float, sweep.pressures), reverse=True)
    elif sweep.phi is not None:
        parameters["phi"] = sorted(map(float, sweep.phi))
    else:
        parameters["onset"] = True
    if {"spectra", "correlation", "modes", *FLOWS} & set(sweep.observables):
        parameters["damping"] = {law: sorted(map(float, values)) for law, values in sweep.damping.model_dump().items()}
    if {"spectra", "correlation", "quasistatic"} & set(sweep.observables):
        parameters["prestress"] = sorted(sweep.prestress)
    for key in FLOWS:
        if (flow := getattr(sweep, key)) is not None:
            given = flow.model_dump()
            parameters[key] = {k: sorted(map(float, v)) if isinstance(v, list) else v for k, v in given.items()}
    for key in ("omega", "correlation_omega"):
        if getattr(sweep, key) is not None:
            parameters[key] = sorted(map(float, getattr(sweep, key)))
    return parameters


def _plain(value: Any) -> Any:
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value
