"""Prepare the tables that figures are drawn from, those of a campaign or of the reference data."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
import pandas as pd

from jamlab.errors import InputError, StorageError
from jamlab.rheology.mode_motion import MOTIONS
from jamlab.studies.droplet_tables import (
    COUNTS,
    DAMPING,
    LAW,
    PACKING,
    droplet_states,
    modes_at_fractions,
    spectra_at_fractions,
    voids_by_state,
)
from jamlab.studies.ensembles import add_distances, select_followed, select_usual

OF_PAPERS = ("states", "onset", "void_counts", "spectra", "quasistatic", "correlation")
OF_FLOWS = ("flow", "oscillation", "creep")
OF_BEYOND = ("droplet_states", "droplet_spectra", "droplet_modes", "droplet_voids")
NAMES = (*OF_PAPERS, *OF_FLOWS, *OF_BEYOND)
RHO_BIN = 0.01  # width of the bins in which voids are counted
STATES = (
    *("model", "n", "seed", "state", "rho", "phi", "z", "rattlers", "pressure", "g", "shape"),
    *("d_rho", "d_phi", "d_z", "overlap", "lost", "excess", "u"),
)
LATER = ("g_x", "rho_printed")  # columns of states that packings from before lack: G along x, rho by eq 12 as printed
FLOW_RUN = (  # what tells packings, laws and settings of flows apart
    *("model", "n", "seed", "ensemble", "phi", "rho", "target_pressure", "law", "beta", "eta_f", "alpha"),
    *("background", "tolerance"),
)
COLUMNS = {
    "states": (*STATES[:3], "ensemble", *STATES[3:], *LATER),
    "onset": ("model", "n", "seed", "ensemble", "rho_J", "phi_J", "z_J", "rattlers", "converged", *COUNTS),
    "void_counts": ("model", "n", "seed", "ensemble", "onset", "rho", "sides", "voids", "area", "shape"),
    "spectra": (
        *("n", "seed", "ensemble", "target_pressure", "law", "beta", "eta_f", "prestress", "omega"),
        *("storage", "loss", "g0", "eta0", "eta_inf", "converged"),
    ),
    "quasistatic": ("n", "seed", "ensemble", "pressure", "prestress", "approach", "sliding", "nonaffine"),
    "correlation": (
        *("n", "seed", "ensemble", "pressure", "law", "beta", "eta_f", "prestress", "omega", "box", "delta", "c"),
    ),
    "flow": (
        *FLOW_RUN,
        *("rate", "stress", "stress_error", "elastic_stress", "elastic_stress_error", "flow_pressure"),
        *("flow_pressure_error", "peak_stress", "peak_strain", "converged"),
    ),
    "oscillation": (
        *(*FLOW_RUN, "omega", "amplitude", "storage", "loss", "third_over_first", "error", "equivalent_storage"),
        *("equivalent_loss", "equivalent_time", "converged"),
    ),
    "creep": (
        *(*FLOW_RUN, "stress", "residual", "final_time", "final_strain", "final_rate", "slope", "flows", "rests"),
        "converged",
    ),
    "droplet_states": (*STATES, "rho_J", *LAW),
    "droplet_spectra": (*PACKING, *DAMPING, "rho", "omega", "storage", "loss"),
    "droplet_modes": (*PACKING, *DAMPING, "rho", "rate", "strength", *MOTIONS, "sliding"),
    "droplet_voids": (*PACKING, "state", "rho", "overlap", "voids", "three", "shape_of_three"),
}


class AbsentTableError(StorageError):
    """A table that a folder does not have: another may serve in its place, which none may for a damaged one."""


def _prepared(name: str, prepare: Callable[[pd.DataFrame], pd.DataFrame]) -> "cached_property[pd.DataFrame]":
    """Give a table as it is drawn from."""

    def table(tables: "EnsembleTables") -> pd.DataFrame:
        return _require_rows(name, prepare(_require_rows(name, tables.read(name))))

    return cached_property(table)


def _shipped(
    name: str, make: Callable[..., pd.DataFrame], *sources: str, then: Callable[..., pd.DataFrame] | None = None
) -> "cached_property[pd.DataFrame]":
    """Give a table that ships with the reference data, or is made of those that a campaign has."""

    def table(tables: "EnsembleTables") -> pd.DataFrame:
        try:
            found = _require_rows(name, tables.read(name))
        except (AbsentTableError, InputError, KeyError):
            found = _require_rows(name, make(*map(tables.read, sources)))
        return then(found) if then else found

    return cached_property(table)


def _require_rows(name: str, table: pd.DataFrame) -> pd.DataFrame:
    if table.empty:
        raise InputError(f"the table {name} has no usable row: run a campaign that measures it, or use another source")
    return table


def _converged_at_pressures(spectra: pd.DataFrame) -> pd.DataFrame:
    """Leave out droplets and sweeps from onset, which have no target pressure."""
    return spectra[spectra["target_pressure"].notna() & spectra["converged"].astype(bool)]


def _at_targets(table: pd.DataFrame) -> pd.DataFrame:
    """Replace the measured pressure by the target, which packings share to the last digit."""
    return table.assign(pressure=table["target_pressure"]) if "target_pressure" in table else table


def count_voids(voids: pd.DataFrame) -> pd.DataFrame:
    """Sum over the voids of each packing, by bin of rho (0.01) and number of sides; onset (state 0) is kept apart.

    Columns: voids: their number; area: sum of areas over the mean particle's; shape: sum of shape factors. A packing
    can still be resampled as a whole from these.
    """
    voids = voids[voids["onset"].notna()]  # packings at a pressure belong to no sweep
    at_onset = voids["state"] == 0
    rho = np.where(at_onset, voids["onset"], (np.floor(voids["rho"] / RHO_BIN) + 0.5) * RHO_BIN)
    v = voids.assign(onset=at_onset, rho=np.round(rho, 9), voids=1, area=voids["area"] / voids["particle_area"])
    keys = ["model", "n", "seed", "ensemble", "onset", "rho", "sides"]
    return v.groupby(keys, as_index=False)[["voids", "area", "shape"]].sum()


class EnsembleTables:
    """The tables of an ensemble by name, prepared once; states, spectra and onsets hold only what converged.

    Runs of flow without an answer are left out. For droplet_states and its kin see `jamlab.studies.droplet_tables`.

    Args:
        read: gives a table by its name, such as `jamlab.open_campaign(path).table`; can be pickled where several
            processes draw.
        facts: what the page says about the origin of the tables.
    """

    def __init__(self, read: Callable[[str], pd.DataFrame], facts: dict[str, str] | None = None) -> None:
        self.read = read
        self.facts = facts or {}

    states = _prepared("states", lambda table: select_followed(select_usual(add_distances(table))))
    void_counts = _shipped("void_counts", count_voids, "voids", then=select_usual)
    spectra = _prepared("spectra", _converged_at_pressures)
    quasistatic = _prepared("quasistatic", lambda table: _at_targets(table.dropna(subset=["sliding"])))
    correlation = _prepared("correlation", _at_targets)
    flow = _prepared("flow", lambda table: table.dropna(subset=["stress"]))
    oscillation = _prepared("oscillation", lambda table: table.dropna(subset=["storage"]))
    creep = _prepared("creep", lambda table: table.dropna(subset=["final_strain"]))
    droplet_states = _shipped("droplet_states", droplet_states, "states")
    droplet_spectra = _shipped("droplet_spectra", spectra_at_fractions, "states", "spectra")
    droplet_modes = _shipped("droplet_modes", modes_at_fractions, "states", "modes")
    droplet_voids = _shipped("droplet_voids", voids_by_state, "states", "voids")

    @cached_property
    def onset(self) -> pd.DataFrame:
        """One row per packing at onset, of the usual protocol, with what `held_motions` counts if that is known."""
        table = self._counted(select_usual(self.read("onset")))
        return _require_rows("onset", table[table["converged"].astype(bool)])

    def _counted(self, onset: pd.DataFrame) -> pd.DataFrame:
        """Join onsets with the counts that a campaign keeps in its states; those that ship have them."""
        if "task" not in onset or set(COUNTS) & set(onset.columns):
            return onset
        states = self.read("states")
        if not set(COUNTS) <= set(states.columns):
            return onset
        return onset.merge(states.loc[states["state"] == 0, ["task", *COUNTS]], on="task", how="left")
