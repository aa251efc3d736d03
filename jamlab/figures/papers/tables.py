"""Prepare the tables that figures are drawn from: those of a campaign, or the reference data shipped with jamlab."""

import gzip
import json
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from jamlab.errors import InputError, StorageError
from jamlab.figures.papers.beyond_tables import (
    DAMPING,
    LAW,
    PACKING,
    droplet_states,
    modes_at_fractions,
    spectra_at_fractions,
    voids_by_state,
)
from jamlab.figures.papers.ensembles import add_distances, select_usual
from jamlab.packing.atomic_file import atomic_file, make_folder
from jamlab.rheology.mode_motion import MOTIONS

OF_PAPERS = ("states", "onset", "void_counts", "spectra", "quasistatic", "correlation")
OF_FLOWS = ("flow", "oscillation", "creep")
OF_BEYOND = ("droplet_states", "droplet_spectra", "droplet_modes", "droplet_voids")
NAMES = (*OF_PAPERS, *OF_FLOWS, *OF_BEYOND)
COUNTS = ("load_bearing", "pairs", "site_contacts", "self_stresses", "free_motions")  # of `count_motions`
RECORD = "reference.json"  # origin of the tables
TABLE_FILE = "{}.csv.gz"
RHO_BIN = 0.01  # width of the bins in which voids are counted
STATES = (
    *("model", "n", "seed", "state", "rho", "phi", "z", "rattlers", "pressure", "g", "b", "shape"),
    *("d_rho", "d_phi", "d_z", "overlap", "lost", "excess", "u"),
)
_FLOW_RUN = (  # what tells packings, laws and settings of flows apart
    *("model", "n", "seed", "phi", "rho", "target_pressure", "law", "beta", "eta_f", "alpha"),
    *("background", "tolerance"),
)
_COLUMNS = {
    "states": STATES,
    "onset": ("model", "n", "seed", "rho_J", "phi_J", "z_J", "rattlers", "converged", *COUNTS),
    "void_counts": ("model", "n", "seed", "onset", "rho", "sides", "voids", "area", "shape"),
    "spectra": (
        *("n", "seed", "target_pressure", "law", "beta", "eta_f", "prestress", "omega", "storage", "loss"),
        *("g0", "eta0", "eta_inf", "converged"),
    ),
    "quasistatic": ("n", "seed", "pressure", "prestress", "approach", "sliding", "nonaffine"),
    "correlation": ("n", "seed", "pressure", "law", "beta", "eta_f", "prestress", "omega", "box", "delta", "c"),
    "flow": (
        *_FLOW_RUN,
        *("rate", "stress", "stress_error", "elastic_stress", "elastic_stress_error", "flow_pressure"),
        *("flow_pressure_error", "peak_stress", "peak_strain", "converged"),
    ),
    "oscillation": (
        *(*_FLOW_RUN, "omega", "amplitude", "storage", "loss", "third_over_first", "error", "equivalent_storage"),
        *("equivalent_loss", "equivalent_time", "converged"),
    ),
    "creep": (
        *(*_FLOW_RUN, "stress", "residual", "final_time", "final_strain", "final_rate", "slope", "flows", "rests"),
        "converged",
    ),
    "droplet_states": (*STATES, "rho_J", *LAW),
    "droplet_spectra": (*PACKING, *DAMPING, "rho", "omega", "storage", "loss"),
    "droplet_modes": (*PACKING, *DAMPING, "rho", "rate", "strength", *MOTIONS, "sliding"),
    "droplet_voids": (*PACKING, "state", "rho", "overlap", "voids", "three", "shape_of_three"),
}
_DIGITS = {"c": 4, "omega": 12, "loss": 8, "g0": 8}  # significant digits kept; 6 elsewhere. Eq 18 of [T] is met to 1e-6
_EXACT = {"rho": 9, "phi": 9, "rho_J": 9, "phi_J": 9}


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
        """See `jamlab.figures.papers.ensembles.add_distances`."""
        return _require_rows("states", add_distances(self._read("states")))

    @cached_property
    def onset(self) -> pd.DataFrame:
        """One row per packing at onset, of the usual protocol, with what `held_motions` counts if that is known."""
        table = self._counted(select_usual(self._read("onset")))
        return _require_rows("onset", table[table["converged"].astype(bool)])

    @cached_property
    def void_counts(self) -> pd.DataFrame:
        """See `count_voids`; shipped with the reference data, counted from the voids of a campaign."""
        return self._shipped_or("void_counts", lambda: count_voids(self._read("voids")))

    @cached_property
    def spectra(self) -> pd.DataFrame:
        """One row per packing, law and frequency."""
        table = _require_rows("spectra", self._read("spectra"))
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
        """States of droplets of several force laws, see `beyond_tables`."""
        return self._shipped_or("droplet_states", lambda: droplet_states(self._read("states")))

    @cached_property
    def droplet_spectra(self) -> pd.DataFrame:
        """G* of droplets and disks at a few packing fractions, see `beyond_tables`."""
        return self._shipped_or(
            "droplet_spectra", lambda: spectra_at_fractions(self._read("states"), self._read("spectra"))
        )

    @cached_property
    def droplet_modes(self) -> pd.DataFrame:
        """Strength of relaxation modes of droplets by rate and motion, see `beyond_tables`."""
        return self._shipped_or("droplet_modes", lambda: modes_at_fractions(self._read("states"), self._read("modes")))

    @cached_property
    def droplet_voids(self) -> pd.DataFrame:
        """Voids between droplets of several force laws, see `beyond_tables`."""
        return self._shipped_or("droplet_voids", lambda: voids_by_state(self._read("states"), self._read("voids")))

    def _counted(self, onset: pd.DataFrame) -> pd.DataFrame:
        """Onsets with the counts that a campaign keeps in its states; those that ship have them."""
        if "task" not in onset or set(COUNTS) & set(onset.columns):
            return onset
        states = self._read("states")
        if not set(COUNTS) <= set(states.columns):
            return onset
        return onset.merge(states.loc[states["state"] == 0, ["task", *COUNTS]], on="task", how="left")

    def _shipped_or(self, name: str, made: Callable[[], pd.DataFrame]) -> pd.DataFrame:
        """A table that ships with the reference data, or is made of the tables of a campaign."""
        try:
            return _require_rows(name, self._read(name))
        except (StorageError, InputError, KeyError):
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
    at_onset = voids["state"] == 0
    rho = np.where(at_onset, voids["onset"], (np.floor(voids["rho"] / RHO_BIN) + 0.5) * RHO_BIN)
    v = voids.assign(onset=at_onset, rho=np.round(rho, 9), voids=1, area=voids["area"] / voids["particle_area"])
    keys = ["model", "n", "seed", "onset", "rho", "sides"]
    return v.groupby(keys, as_index=False)[["voids", "area", "shape"]].sum()


_WHO: dict[str, list[str]] = {  # what tells the packings, and the laws that they were measured under, apart
    "states": ["model", "n", "seed"],
    "onset": ["model", "n", "seed"],
    "void_counts": ["model", "n", "seed"],
    "spectra": ["n", "seed", "target_pressure", "law", "beta", "eta_f", "prestress"],
    "quasistatic": ["n", "seed", "pressure", "prestress"],
    "correlation": ["n", "seed", "pressure", "law", "beta", "eta_f", "prestress"],
    "flow": [*_FLOW_RUN, "rate"],
    "oscillation": [*_FLOW_RUN, "omega", "amplitude"],
    "creep": [*_FLOW_RUN, "stress"],
    "droplet_states": PACKING,
    "droplet_spectra": [*PACKING, *DAMPING],
    "droplet_modes": [*PACKING, *DAMPING],
    "droplet_voids": PACKING,
}


def combine(new: EnsembleTables, old: EnsembleTables) -> EnsembleTables:
    """Add packings to tables that are there: a packing of both is that of the new ones."""

    def read(name: str) -> pd.DataFrame:
        parts: list[pd.DataFrame] = []
        for tables in (new, old):
            try:
                parts.append(getattr(tables, name))
            except (InputError, StorageError, KeyError):
                continue
        if len(parts) < 2:
            return parts[0] if parts else pd.DataFrame()
        first, second = (pd.MultiIndex.from_frame(part[_WHO[name]].fillna(-1)) for part in parts)
        shared = set(parts[0]) & set(parts[1]) | set(COUNTS)  # counts came later: nan in packings from before
        kept = [[c for c in _COLUMNS[name] if c in part and c in shared] for part in parts]
        return pd.concat([parts[0][kept[0]], parts[1].loc[~second.isin(first), kept[1]]], ignore_index=True)

    return EnsembleTables(read, old.facts | new.facts)


def reference_tables() -> EnsembleTables:
    """Tables of the reference data shipped with jamlab: those of the papers, and of flows from a campaign of their own.

    Raises:
        StorageError: the data are missing.
    """
    place = Path(str(resources.files("jamlab.figures.papers")))
    facts = read_folder(place / "reference").facts
    for what, folder in (("flows", "reference_flows"), ("droplets of several laws", "reference_beyond")):
        facts = facts | {
            f"{name} of {what}": read_folder(place / folder).facts[name] for name in ("campaign", "commit")
        }
    return EnsembleTables(partial(_read_shipped, place), facts)


def _read_shipped(place: Path, name: str) -> pd.DataFrame:
    folder = "reference_flows" if name in OF_FLOWS else "reference_beyond" if name in OF_BEYOND else "reference"
    return _read_table(place / folder, name)


def read_folder(folder: Path) -> EnsembleTables:
    """Read tables from a folder that `save` wrote.

    Raises:
        StorageError: no such folder; later, on use, a table that is missing or cannot be read.
    """
    record = folder / RECORD
    try:
        facts = json.loads(record.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StorageError(
            f"{record} cannot be read ({error}): give a folder of reference tables or a campaign"
        ) from None

    return EnsembleTables(partial(_read_table, folder), {name: str(value) for name, value in facts["facts"].items()})


def _read_table(folder: Path, name: str) -> pd.DataFrame:
    path = folder / TABLE_FILE.format(name)
    try:
        return pd.read_csv(path)
    except (OSError, ValueError, EOFError) as error:
        raise StorageError(f"{path} cannot be read ({error}): make it with a campaign that measures {name}") from None


def save(
    tables: EnsembleTables,
    folder: Path,
    facts: dict[str, Any],
    campaign: str = "",
    before: dict[str, Any] | None = None,
    names: Sequence[str] = NAMES,
) -> dict[str, int]:
    """Write the tables as reference data, thinned to what figures use: about 6 digits, csv.gz, one JSON record.

    Args:
        tables: of a campaign.
        folder: created if missing; its tables are replaced.
        facts: versions, commit and other entries for the page; kept in reference.json.
        campaign: text of the campaign file, kept there too.
        before: content of the reference.json that some of the packings had before, see `combine`.
        names: of the tables to write.

    Returns:
        Name of each table -> bytes written. Tables without rows are left out.

    Raises:
        StorageError: the folder cannot be written.
        InputError: no table has rows.
    """
    make_folder(folder)
    written: dict[str, int] = {}
    rows: dict[str, int] = {}
    for name in names:
        path = folder / TABLE_FILE.format(name)
        try:
            table = getattr(tables, name)
        except (InputError, StorageError, KeyError):
            path.unlink(missing_ok=True)
            continue
        kept = _round_floats(table[[c for c in _COLUMNS[name] if c in table]])
        with atomic_file(path) as temporary:
            temporary.write_bytes(gzip.compress(kept.to_csv(index=False).encode(), mtime=0))
        written[name], rows[name] = path.stat().st_size, len(kept)
    if not written:
        raise InputError("no table has rows: finish some tasks of the campaign first")
    content = {"schema": "jamlab-reference", "version": 1, "facts": facts, "rows": rows, "campaign": campaign}
    if before is not None:
        content["before"] = before
    with atomic_file(folder / RECORD) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return written


def _round_floats(table: pd.DataFrame) -> pd.DataFrame:
    """Round floats to significant digits."""
    out = table.copy()
    for name in out.select_dtypes("float").columns:
        digits = _EXACT.get(name, _DIGITS.get(name, 6))
        values = out[name].to_numpy(dtype=np.float64)
        power = np.zeros_like(values)
        some = np.isfinite(values) & (values != 0)
        power[some] = np.floor(np.log10(np.abs(values[some]))) + 1 - digits
        # a power of ten is exact only upwards
        up = power < 0
        rounded = np.where(up, np.round(values * 10.0 ** np.abs(power)) / 10.0 ** np.abs(power), values)
        out[name] = np.where(up, rounded, np.round(values / 10.0 ** np.abs(power)) * 10.0 ** np.abs(power))
    return out
