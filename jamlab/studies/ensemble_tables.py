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
FLOW_RUN = (  # what tells packings, laws and settings of flows apart
    *("model", "n", "seed", "ensemble", "phi", "rho", "target_pressure", "law", "beta", "eta_f", "alpha"),
    *("background", "tolerance"),
)
COLUMNS = {
    "states": (*STATES[:3], "ensemble", *STATES[3:]),
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


class EnsembleTables:
    """The tables of an ensemble by name, prepared once; states, spectra and onsets hold only what converged.

    Args:
        read: gives a table by its name, such as `jamlab.open_campaign(path).table`; can be pickled where several
            processes draw.
        facts: what the page says about the origin of the tables.
    """

    def __init__(self, read: Callable[[str], pd.DataFrame], facts: dict[str, str] | None = None) -> None:
        self._read = read
        self.facts = facts or {}

    @cached_property
    def states(self) -> pd.DataFrame:
        """See `add_distances` and `select_followed` in `jamlab.studies.ensembles`."""
        return _require_rows("states", select_followed(select_usual(add_distances(self._read("states")))))

    @cached_property
    def onset(self) -> pd.DataFrame:
        """One row per packing at onset, of the usual protocol, with what `held_motions` counts if that is known."""
        table = self._counted(select_usual(self._read("onset")))
        return _require_rows("onset", table[table["converged"].astype(bool)])

    @cached_property
    def void_counts(self) -> pd.DataFrame:
        """See `count_voids`; shipped with the reference data, counted from the voids of a campaign."""
        return select_usual(self._shipped_or("void_counts", lambda: count_voids(self._read("voids"))))

    @cached_property
    def spectra(self) -> pd.DataFrame:
        """One row per packing, law and frequency."""
        table = _require_rows("spectra", self._read("spectra"))
        table = table[table["target_pressure"].notna()]  # droplets and sweeps from onset have none
        return _require_rows("spectra", table[table["converged"].astype(bool)])

    @cached_property
    def quasistatic(self) -> pd.DataFrame:
        """One row per packing sheared slowly."""
        return _require_rows("quasistatic", _replace_pressure(self._read("quasistatic").dropna(subset=["sliding"])))

    @cached_property
    def correlation(self) -> pd.DataFrame:
        """One row per packing, law, frequency and distance."""
        return _require_rows("correlation", _replace_pressure(self._read("correlation")))

    @cached_property
    def flow(self) -> pd.DataFrame:
        """One row per packing, law and rate of shear; runs without an answer are left out."""
        return _require_rows("flow", self._read("flow").dropna(subset=["stress"]))

    @cached_property
    def oscillation(self) -> pd.DataFrame:
        """One row per packing, law, frequency and amplitude; runs without an answer are left out."""
        return _require_rows("oscillation", self._read("oscillation").dropna(subset=["storage"]))

    @cached_property
    def creep(self) -> pd.DataFrame:
        """One row per packing, law and stress; runs without an answer are left out."""
        return _require_rows("creep", self._read("creep").dropna(subset=["final_strain"]))

    @cached_property
    def droplet_states(self) -> pd.DataFrame:
        """States of droplets of several force laws, see `jamlab.studies.droplet_tables`."""
        return self._shipped_or("droplet_states", lambda: droplet_states(self._read("states")))

    @cached_property
    def droplet_spectra(self) -> pd.DataFrame:
        """G* of droplets and disks at a few packing fractions, see `jamlab.studies.droplet_tables`."""
        return self._shipped_or(
            "droplet_spectra", lambda: spectra_at_fractions(self._read("states"), self._read("spectra"))
        )

    @cached_property
    def droplet_modes(self) -> pd.DataFrame:
        """Strength of relaxation modes of droplets by rate and motion, see `jamlab.studies.droplet_tables`."""
        return self._shipped_or("droplet_modes", lambda: modes_at_fractions(self._read("states"), self._read("modes")))

    @cached_property
    def droplet_voids(self) -> pd.DataFrame:
        """Voids between droplets of several force laws, see `jamlab.studies.droplet_tables`."""
        return self._shipped_or("droplet_voids", lambda: voids_by_state(self._read("states"), self._read("voids")))

    def _counted(self, onset: pd.DataFrame) -> pd.DataFrame:
        """Join onsets with the counts that a campaign keeps in its states; those that ship have them."""
        if "task" not in onset or set(COUNTS) & set(onset.columns):
            return onset
        states = self._read("states")
        if not set(COUNTS) <= set(states.columns):
            return onset
        return onset.merge(states.loc[states["state"] == 0, ["task", *COUNTS]], on="task", how="left")

    def _shipped_or(self, name: str, made: Callable[[], pd.DataFrame]) -> pd.DataFrame:
        """Read a table that ships with the reference data, or is made of the tables of a campaign."""
        try:
            return _require_rows(name, self._read(name))
        except (AbsentTableError, InputError, KeyError):
            return _require_rows(name, made())


def _replace_pressure(table: pd.DataFrame) -> pd.DataFrame:
    """Replace the measured pressure by the target, which packings share to the last digit."""
    return table.assign(pressure=table["target_pressure"]) if "target_pressure" in table else table


def _require_rows(name: str, table: pd.DataFrame) -> pd.DataFrame:
    if table.empty:
        raise InputError(f"the table {name} has no usable row: run a campaign that measures it, or use another source")
    return table


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
