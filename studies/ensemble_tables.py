"""Prepare the tables of a campaign or of the reference data, from which figures are drawn."""

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from jamlab.arrays import Array
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError
from jamlab.rheology.mode_character import MOTIONS
from studies.ensembles import FEWEST, Ensemble, at_places, interpolators, select
from studies.tables import AbsentTableError

COUNTS = ("load_bearing", "pairs", "site_contacts", "self_stresses", "free_motions")  # of `count_motions`
LAW = ["gamma", "eps", "nv_small"]  # what tells the force laws of droplets apart; nan for disks
DEFAULT_LAW = {name: float(defaults("dp")[name]) for name in LAW}
PACKING = ["model", "n", "seed", *LAW]
ALL_LAW = ("gamma", "delta", "eps", "nv_small")
BY_LAW = {  # of droplets, by name: column of states, and the abscissa and place at which it is taken
    "void_090": ("void", "rho", 0.90),
    "void_098": ("void", "rho", 0.98),
    "g": ("g", "d_rho", 0.15),
    "shape_factor": ("shape_factor", "rho", 0.9895),
    "z_010": ("z", "d_rho", 0.1),
}
DAMPING = ["damping", "beta", "eta_f"]
SHARED = "shared_fraction"
FRACTIONS = (0.86, 0.88, 0.90, 0.92, 0.94, 0.96)  # at which spectra are interpolated
RATE_BINS = np.geomspace(1e-6, 1e6, 49)  # four in a decade; what lies beyond counts in the last one
_MET = 1e-5  # a sweep ends so close to its last packing fraction, on either side
_WIDEST = 0.03  # states further apart are no neighbours: one between them did not converge
PACKING_OF_STATES = ["model", "n", "seed"]
STABILIZED = "shear-stabilized"
# whose G is averaged: all packings; those that resist shear along x, at each state; shear-stabilised boxes
PACKINGS = ("all", "G_x > 0", STABILIZED)
ABOVE_ONSET = 1e-3, 1e-2  # distances from onset between which sweeps end that are followed for the contacts near it


def of_papers(table: pd.DataFrame, ensemble: str = "fixed-box") -> pd.DataFrame:
    """Select the packings that figures of the papers show: sweeps in boxes of fixed shape, droplets of the default
    law."""
    for name, value in {"ensemble": ensemble, "units": "eps"}.items():
        if name in table:
            table = table[table[name] == value]
    for name in ("gamma", "ka", "delta", "eps", "nv_small"):
        if name in table:
            usual = np.isclose(table[name].astype(float), float(defaults("dp")[name]))
            table = table[usual | (table["model"] == "sp")]
    return table


def add_distances(states: pd.DataFrame) -> pd.DataFrame:
    """Add distances from the onset of its own packing to each state; leave out states that are not jammed minima.

    Columns added: d_rho, d_phi, d_z: rho, phi and z minus their values at onset; overlap: phi - rho; lost: 1 - <a>/a_J,
    the fraction of their area that particles lose, from rho/phi since phi times the cell's area is constant; excess:
    A - 1 for disks, A - A_J for polygons; u: energy per particle. Tables with these columns are returned unchanged.
    """
    if "lost" in states:
        return states
    s = states[states["rho_J"].notna()]  # packings at a pressure have none
    s = s if "z_strong" in s else s.assign(z_strong=np.nan)
    first = s[s["state"] == 0].set_index(PACKING_OF_STATES)[["z", "z_strong", "shape_factor"]].add_suffix("_J")
    s = s.join(first, on=PACKING_OF_STATES)
    s = s[s["converged"].astype(bool) & s["z"].notna()]
    return s.assign(
        d_rho=s["rho"] - s["rho_J"],
        d_phi=s["phi"] - s["phi_J"],
        d_z=s["z"] - s["z_J"],
        d_z_strong=s["z_strong"] - s["z_strong_J"],
        overlap=s["phi"] - s["rho"],
        lost=1 - s["rho"] / s["phi"] * s["phi_J"] / s["rho_J"],
        excess=np.where(s["model"] == "sp", s["shape_factor"] - 1, s["shape_factor"] - s["shape_factor_J"]),
        u=s["energy"] / s["n"],
    )


def stabilized_disks(states: pd.DataFrame) -> pd.DataFrame:
    """Select the sweeps of shear-stabilised disks, with their distances from onset."""
    return add_distances(of_papers(states[states["model"] == "sp"], STABILIZED))


def add_confluence(states: pd.DataFrame) -> pd.DataFrame:
    """Add what is missing to confluence, and both ways of eq 12, to states that have distances.

    Columns added: to_confluence, missing, left: rho* - rho, 6 - z and 1 - rho below rho*, where a packing first has
    z >= 6, nan elsewhere; d_printed: rho by eq 12 as printed, less that at onset; three: that less the exact rho, which
    is what three disks share; g_beside_x: G of packings that were sheared along x too."""
    s = states.assign(**{name: states.get(name, np.nan) for name in LATER[:5]})
    full = s[s["z"] >= 6].groupby(PACKING_OF_STATES)["rho"].min().rename("rho_star")
    s = s.join(full, on=PACKING_OF_STATES)
    below = (s["rho"] < s["rho_star"]) & (s["z"] < 6)
    return s.assign(
        to_confluence=(s["rho_star"] - s["rho"]).where(below),
        missing=(6 - s["z"]).where(below),
        left=(1 - s["rho"]).where(below),
        d_printed=s["rho_printed"] - s["phi"] + s["d_phi"],
        three=s["rho_printed"] - s["rho"],
        g_beside_x=s["g"].where(s["g_x"].notna()),
    )


def modes_at_fractions(states: pd.DataFrame, modes: pd.DataFrame) -> pd.DataFrame:
    """Sum the strength of relaxation modes of each packing by rate, in bins, and how much of it is in which motion.
    Columns: rate, the centre of a bin; strength; translation, rotation, along, across: parts of the strength that add
    up to it; sliding: its part in modes that dissipate by sliding."""
    rows = _join_states(states, modes)
    place = np.clip(np.searchsorted(RATE_BINS, rows["rates"]) - 1, 0, len(RATE_BINS) - 2)
    parts = {name: rows[name] * rows["strengths"] for name in (*MOTIONS, "sliding")}
    binned = rows.assign(rate=np.sqrt(RATE_BINS[1:] * RATE_BINS[:-1])[place], strength=rows["strengths"], **parts)
    values = ["strength", *MOTIONS, "sliding"]
    who = [*PACKING, *DAMPING, "state", "rho"]
    sums = binned.groupby([*who, "rate"], as_index=False, dropna=False)[values].sum()
    return _interpolate(sums, who[:-2], "rate", values, 0.0)


def voids_by_state(states: pd.DataFrame, voids: pd.DataFrame) -> pd.DataFrame:
    """Count voids of each state: of all, of those with three sides, and the sum of the shape factors of these."""
    three = voids["sides"] == 3
    counted = voids.assign(voids=1, three=three.astype(int), shape_of_three=np.where(three, voids["shape_factor"], 0.0))
    sums = counted.groupby(["task", "state"], as_index=False)[["voids", "three", "shape_of_three"]].sum()
    rows = _join_states(states, sums)
    if SHARED not in rows:
        raise InputError(f"the table states has no {SHARED}: add the observable 'observables:{SHARED}' to the campaign")
    return rows[rows["model"] == "dp"].rename(columns={SHARED: "overlap"})


def droplets_by_law(states: pd.DataFrame, voids: pd.DataFrame) -> pd.DataFrame:
    """Reduce each sweep or onset of droplets, of any law, to what Boromand et al. print of theirs: rho_J, z_J, the mean
    shape factor of voids with three sides at onset, rho where z is 6, and `BY_LAW` between states; else nan."""
    three = voids[voids["sides"] == 3].groupby(["task", "state"])["shape_factor"].mean().rename("void")
    rows = states[(states["model"] == "dp") & states["converged"].astype(bool)].join(three, on=["task", "state"])
    found = []
    for law, part in rows.sort_values("rho").groupby(["n", "seed", *ALL_LAW]):
        first = part.iloc[0]
        if first["state"] != 0:
            continue
        part, values = part.assign(d_rho=part["rho"] - first["rho"]), []
        for column, by, place in BY_LAW.values():
            known = part.dropna(subset=[column])
            values.append(
                np.interp(place, known[by], known[column], left=np.nan, right=np.nan) if len(known) else np.nan
            )
        full = part.loc[part["z"] >= 6, "rho"]
        found.append((*law, first["rho"], first["z"], first["void"], full.min(), *values))
    return pd.DataFrame(found, columns=list(COLUMNS["droplet_laws"]))


def droplets_above_onset(states: pd.DataFrame) -> pd.DataFrame:
    """Select sweeps of droplets that end near onset. They are no part of `states`, whose curves end where fewer than
    half of the packings are known."""
    if "rho_J" not in states:
        raise InputError("the table states is of whole sweeps: reduce the campaign of those that end near onset")
    droplets = of_papers(states[states["model"] == "dp"])
    droplets = droplets.assign(end=droplets["rho"] - droplets["rho_J"])
    ends = droplets.groupby(PACKING_OF_STATES)["end"].transform("max")
    return add_distances(droplets[ends.between(*ABOVE_ONSET)]).drop(columns="end")


def onsets_by_start(onset: pd.DataFrame, states: pd.DataFrame) -> pd.DataFrame:
    """Select onsets of droplets and disks that say how they started, with both counts of contacts and of motions."""
    if "start" not in onset:
        raise InputError("the table onset does not say how packings started: read it from its campaign once more")
    own = ["task", *({*COUNTS, "z_strong", "rattlers_strong"} & set(states.columns))]
    found = of_papers(onset).merge(states.loc[states["state"] == 0, own], on="task", how="left")
    return found[found["converged"].astype(bool)]


def _join_states(states: pd.DataFrame, rows: pd.DataFrame) -> pd.DataFrame:
    """Select rows of converged states; adds rho, what particles share if that is known, and the force law."""
    kept = ["task", "state", *PACKING, "rho", *({SHARED} & set(states.columns))]
    good = states.loc[states["converged"].astype(bool), kept]
    own = [column for column in rows.columns if column not in good.columns or column in ("task", "state")]
    return good.merge(rows[own], on=["task", "state"])


def _interpolate(rows: pd.DataFrame, who: list[str], along: str, values: Sequence[str], absent: float) -> pd.DataFrame:
    """Interpolate values of each packing at the `FRACTIONS` between states; a row for each place `along`, which a state
    may lack: then `absent` stands for it."""
    out = []
    for key, part in rows.groupby(who, dropna=False):
        wide = part.pivot_table(index="rho", columns=along, values=list(values))
        held = wide.fillna(absent).to_numpy(dtype=np.float64)
        rho, named = wide.index.to_numpy(dtype=np.float64), dict[str, Any](zip(who, key, strict=True))
        for place in FRACTIONS:
            weights = _weights(rho, place)
            if weights is not None:
                used = weights > 0
                found = pd.Series(weights[used] @ held[used], wide.columns).unstack(0).reset_index()
                out.append(found.assign(**named, rho=place))
    return pd.concat(out, ignore_index=True) if out else pd.DataFrame(columns=[*who, "rho", along, *values])


def _weights(rho: Array, place: float) -> Array | None:
    """Find (states,) weights of a linear interpolation; None outside, and in a gap."""
    weights = np.zeros(len(rho))
    near = int(np.abs(rho - place).argmin())
    if abs(rho[near] - place) < _MET:
        weights[near] = 1.0
        return weights
    above = int(np.searchsorted(rho, place))
    if not 0 < above < len(rho) or rho[above] - rho[above - 1] > _WIDEST:
        return None
    share = (place - rho[above - 1]) / (rho[above] - rho[above - 1])
    weights[above - 1 : above + 1] = 1 - share, share
    return weights


def droplets_with(table: pd.DataFrame, **changes: float) -> pd.DataFrame:
    """Select the droplets of the default force law, but for some of its parameters."""
    return select(table, model="dp", **DEFAULT_LAW | changes)


def values_of(table: pd.DataFrame, parameter: str) -> list[float]:
    """List the values of one parameter that `FEWEST` packings have, the others of the force law being the defaults."""
    others = {name: value for name, value in DEFAULT_LAW.items() if name != parameter}
    packings = select(table, model="dp", **others).drop_duplicates(PACKING)[parameter].value_counts()
    return sorted(packings.index[packings >= FEWEST].to_numpy(dtype=np.float64).tolist())


RHO_BIN = 0.01  # width of the bins in which voids are counted
STATES = (
    *("model", "n", "seed", "state", "rho", "phi", "z", "rattlers", "pressure", "g", "shape_factor"),
    *("d_rho", "d_phi", "d_z", "overlap", "lost", "excess", "u"),
)
# what every state has: curves of these are made at once, in the time of one
_TOGETHER = ("rho", "phi", "z", "d_rho", "d_phi", "d_z", "shape_factor", "overlap", "lost", "excess", "u")
# of slow shear: critical slopes without rotations, lengths of correlation in other lanes and at zero stress
OWN = (
    *("storage_slope", "loss_slope", "length", "length_half_lane", "length_quarter_lane", "length_imaginary"),
    *("rms_normal", "rms_tangential", "contact_density"),
)
BESIDE = (
    "median_nonaffine_tangential",
    "mean_normal",
    "mean_tangential",
    "mean_nonaffine",
    *OWN,
)  # and means beside medians
# what packings from before lack: G along x, rho by eq 12 as printed, z without contacts that only stop a droplet
LATER = ("g_x", "rho_printed", "z_strong", "rattlers_strong", "d_z_strong", *BESIDE)
_OF = ("model", "n", "seed", "ensemble")  # what tells packings apart; with laws and settings of flows
_MADE = (*_OF, "protocol", "definitions")  # and versions of what made and measured them, where that is known
_STATE = (*_OF, "phi", "rho", "target_pressure")
_FLOW = (*_STATE, "damping", "beta", "eta_f", "alpha", "background_drag", "tolerance")
_SHEARED = ("n", "seed", "ensemble", "pressure", "prestress")
_MOVED = ("median_normal", "median_tangential", "median_nonaffine", *BESIDE)
_FLOWED = (
    *("stress", "stress_stderr", "elastic_stress", "elastic_stress_stderr"),
    *("flow_pressure", "flow_pressure_stderr"),
)
_ONSET = (*_MADE, "rho_J", "phi_J", "z_J", "rattlers", "converged", *COUNTS)
COLUMNS = {  # of the tables that figures are drawn from
    "states": (*_MADE, *STATES[3:], *LATER),
    "droplets_above_onset": (
        *("start", *_MADE, "state", "rho", "phi", "z", "z_strong", "g"),
        *("d_rho", "d_phi", "d_z", "d_z_strong"),
    ),
    "stabilized_disks": (*_MADE, "state", "rho", "phi", "z", "g", "d_rho", "d_phi"),
    "onset": _ONSET,
    "onset_starts": ("start", *_ONSET, "z_strong", "rattlers_strong"),
    "void_counts": (*_OF, "at_onset", "rho", "sides", "voids", "area", "shape_factor"),
    "spectra": (
        *("n", "seed", "ensemble", "target_pressure", "damping", "beta", "eta_f", "prestress"),
        *("omega", "storage", "loss", "g0", "eta0", "eta_inf", "converged"),
    ),
    "quasistatic": (*_SHEARED, *_MOVED),
    "correlation": (*_SHEARED, "damping", "beta", "eta_f", "omega", "box", "delta", "c"),
    "flow": (*_FLOW, "rate", *_FLOWED, "peak_stress", "peak_strain", "converged"),
    "quasistatic_shear": (*_STATE, *_FLOWED[:2], *_FLOWED[-2:], "peak_stress", "peak_strain", "converged"),
    "oscillation": (
        *(*_FLOW, "omega", "amplitude", "storage", "loss", "third_over_first", "change"),
        *("equivalent_storage", "equivalent_loss", "equivalent_time", "converged"),
    ),
    "droplet_modes": (*PACKING, *DAMPING, "rho", "rate", "strength", *MOTIONS, "sliding"),
    "droplet_voids": (*PACKING, "state", "rho", "overlap", "voids", "three", "shape_of_three"),
    "droplet_laws": ("n", "seed", *ALL_LAW, "rho_J", "z_J", "void_J", "rho_star", *BY_LAW),
}
NAMES = tuple(COLUMNS)


def _prepared(name: str, prepare: Callable[[pd.DataFrame], pd.DataFrame]) -> "cached_property[pd.DataFrame]":

    def table(tables: "EnsembleTables") -> pd.DataFrame:
        return _require_rows(name, prepare(_require_rows(name, tables.read(name))))

    return cached_property(table)


def _shipped(name: str, make: Callable[..., pd.DataFrame], *sources: str) -> "cached_property[pd.DataFrame]":
    """Give a table that ships with the reference data, or is made of those that a campaign has."""

    def table(tables: "EnsembleTables") -> pd.DataFrame:
        try:
            found = tables.read(name)
        except (AbsentTableError, InputError, KeyError):
            found = make(*map(tables.read, sources))
        return _require_rows(name, found)

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


def _by_strong(read: Callable[[Any], pd.DataFrame], name: str) -> pd.DataFrame:
    """Read a table with z and d_z of droplets, and z_J where it is known, by strong contacts; disks have no others."""
    if name == "onset_starts":
        found = read(name)
        return found.assign(z_J=found["z_strong"].where(found["model"] == "dp", found["z_J"]))
    if name not in ("states", "onset"):
        return read(name)
    s = add_distances(of_papers(read("states")))
    s = s.assign(**{z: s[f"{z[:-1]}z_strong"].where(s["model"] == "dp", s[z]) for z in ("z", "d_z")})
    if name == "states":
        return s
    first = s[s["state"] == 0].set_index(PACKING_OF_STATES)["z"]
    return of_papers(read("onset")).drop(columns="z_J").join(first.rename("z_J"), on=PACKING_OF_STATES)


def count_voids(states: pd.DataFrame, voids: pd.DataFrame) -> pd.DataFrame:
    """Sum over the voids of each state of the sweeps that figures of the papers show, by bin of rho (0.01) and number
    of sides; those of state 0, at_onset, are kept apart. Columns: voids: their number; area: sum of areas over the mean
    particle's; shape_factor: their sum. A packing can still be resampled as a whole from these."""
    voids = voids.merge(add_distances(of_papers(states))[["task", "state"]])  # no other law, no other ensemble
    at_onset = voids["state"] == 0
    rho = np.where(at_onset, voids["rho_J"], (np.floor(voids["rho"] / RHO_BIN) + 0.5) * RHO_BIN)
    v = voids.assign(at_onset=at_onset, rho=np.round(rho, 9), voids=1, area=voids["area"] / voids["particle_area"])
    keys = ["model", "n", "seed", "ensemble", "at_onset", "rho", "sides"]
    return v.groupby(keys, as_index=False)[["voids", "area", "shape_factor"]].sum()


class EnsembleTables:
    """The tables of an ensemble by name, prepared once, of `read`, which can be pickled where several processes draw.
    States, spectra and onsets hold only what converged; runs of flow without an answer are left out."""

    def __init__(
        self,
        read: Callable[[Any], pd.DataFrame],
        facts: dict[str, str] | None = None,
        made: dict[str, str] | None = None,  # name of a table -> when it was measured, at which commits
    ) -> None:
        self.read = read
        self.facts = facts or {}
        self.made = made or {}
        self.measured: dict[Any, Any] = {}  # by function that measures, see `studies.papers.statements.measure`
        self._curves: dict[tuple[Any, ...], list[Any]] = {}

    states = _prepared("states", lambda table: add_confluence(add_distances(of_papers(table))))
    stabilized_disks = _shipped("stabilized_disks", stabilized_disks, "states")
    void_counts = _shipped("void_counts", count_voids, "states", "voids")
    spectra = _prepared("spectra", _converged_at_pressures)
    correlation = _prepared("correlation", _at_targets)
    flow = _prepared("flow", lambda table: table.dropna(subset=["stress"]))
    quasistatic_shear = _prepared("quasistatic_shear", lambda table: table.dropna(subset=["stress"]))
    oscillation = _prepared("oscillation", lambda table: table.dropna(subset=["storage"]))
    droplet_modes = _shipped("droplet_modes", modes_at_fractions, "states", "modes")
    droplet_voids = _shipped("droplet_voids", voids_by_state, "states", "voids")
    droplet_laws = _shipped("droplet_laws", droplets_by_law, "states", "voids")
    droplets_above_onset = _shipped("droplets_above_onset", droplets_above_onset, "states")
    onset_starts = _shipped("onset_starts", onsets_by_start, "onset", "states")

    def curve(self, model: str, n: int, x: str, y: str, places: ArrayLike, packings: str = PACKINGS[0]) -> Ensemble:
        """Interpolate each packing of one model and size at the same places, of a column of states over another; G, a
        column g, of one of the `PACKINGS`."""
        onset, along_x = bool(np.asarray(places)[0] <= 0), packings == PACKINGS[1]
        table = self.stabilized_disks if packings == STABILIZED else self.states
        column = "g_x" if along_x and y == "g" else y
        together = tuple(name for name in _TOGETHER if name in table) if column in _TOGETHER else (column,)
        if (key := (model, n, x, together, onset, packings)) not in self._curves:
            rows = table[(table["n"] == n) & (table["model"] == model)]
            rows = rows[rows["g_x"].notna()] if along_x else rows
            self._curves[key] = interpolators(rows, x, together, onset)
        found = at_places(self._curves[key], places, together.index(column))
        return Ensemble(found.x, np.where(found.y > 0, found.y, np.nan)) if along_x and y == "g" else found

    @cached_property
    def strong(self) -> "EnsembleTables":
        """The same by the second count of contacts of droplets, without those that only stop one from sliding."""
        return EnsembleTables(partial(_by_strong, self.read), self.facts, self.made)

    def at_onset(self, model: str, n: int) -> pd.DataFrame:
        """The states at onset of one model and size."""
        return select(self.states, model=model, n=n, state=0)

    @cached_property
    def onset(self) -> pd.DataFrame:
        """One row per packing at onset, of the usual protocol, with what `maxwell_count` counts if that is known."""
        table = self._joined(of_papers(self.read("onset")), COUNTS)
        return _require_rows("onset", table[table["converged"].astype(bool)])

    @cached_property
    def quasistatic(self) -> pd.DataFrame:
        """One row per packing and pressure, with and without pre-stress: motion in slow shear."""
        table = _require_rows("quasistatic", self.read("quasistatic")).dropna(subset=["median_tangential"])
        return _require_rows("quasistatic", _at_targets(self._joined(table, OWN)))

    def _joined(self, table: pd.DataFrame, names: Sequence[str]) -> pd.DataFrame:
        """Join a table with columns that a campaign keeps in its states; tables that ship have them."""
        if "task" not in table or set(names) & set(table.columns):
            return table
        states = self.read("states")
        known = [name for name in names if name in states]
        if "state" in table:
            return table.merge(states[["task", "state", *known]], on=["task", "state"], how="left")
        return table.merge(states.loc[states["state"] == 0, ["task", *known]], on="task", how="left")
