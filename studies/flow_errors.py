"""The table behind `choose_flow`: runs of flow beside simpler models, reduced to a grid of errors that they promise.

`flow_errors.csv.xz` beside this file holds the runs, and with them the conditions of a new measurement;
`jamlab/estimates/flow_errors.json` what follows from them.
"""

import time
from collections.abc import Iterable, Iterator
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError, InputError
from jamlab.estimates.flow_errors import CONDITIONS, FlowCondition, FlowErrors, mean_overlap
from jamlab.estimates.ways import read_table
from jamlab.flow.flow_curve import flow_curve
from jamlab.flow.oscillate import oscillate
from jamlab.packing.packing import Packing
from jamlab.protocols.target_pressure import pack
from jamlab.rheology.complex_modulus import complex_modulus
from jamlab.rheology.damping import ContactDamping, StokesDrag
from jamlab.rheology.nonlinear_drag import nonlinear_modulus
from jamlab.statistics.confidence import exceeded_by_few
from studies.estimate_tables import measure_packed

COLUMNS = ("kind", "part", "seed", "n", "pressure", "alpha", "drag", "amplitude", "beta", "error", "scatter", "seconds")
KINDS = ("oscillation", "flow")
_CONDITION = ["alpha", "drag", "amplitude"]
TOLERANCE, CYCLES = 5e-3, 6  # of the runs that count as true
STEADY: dict[str, Any] = {"strain": 3.0, "background_drag": CONDITIONS.background}  # of the averages of steady flow
_FLOOR = 1e-3  # errors below are rounding of the runs, and no measure of how they vary


class Part(StrEnum):
    """Packings of the table, by what they are for."""

    CALIBRATE = "calibrate"  # a few at every condition of a grid
    MANY = "many"  # under linear drag, at strains at which few rearrange
    CHECK = "check"  # others at random conditions, which promises are held against


def read_runs(path: Path | None = None) -> pd.DataFrame:
    """Read the runs of this folder, or of a file written by `python -m studies tables flow-errors`."""
    path = path or Path(__file__).with_name("flow_errors.csv.xz")
    return read_table(path, path.name, COLUMNS, "python -m studies tables flow-errors")


def measure_runs(out: Path, runs: pd.DataFrame | None = None, **how: Any) -> pd.DataFrame:
    """Measure runs anew, at the conditions of some, all by default, and save them after every packing; resumes where it
    stopped. `how`: of `studies.tables.measure`."""
    packings = (read_runs() if runs is None else runs).groupby(["part", "seed"], sort=False)
    tasks = {f"{part}, seed {seed}": partial(_rows_of_packing, rows) for (part, seed), rows in packings}
    facts = {"strain": STEADY["strain"], "background": CONDITIONS.background, "tolerance": TOLERANCE, "cycles": CYCLES}
    measure_packed(out, tasks, facts, **how)
    return read_runs(out)


def _rows_of_packing(runs: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Rows of one packing, one for every condition that has an answer."""
    one = runs.iloc[0]
    packing = pack(int(one["n"]), float(one["pressure"]), int(one["seed"]))
    linear: dict[float, float] = {}  # stress at a rate, which every alpha is compared with
    for row in runs[["kind", *_CONDITION, "beta"]].itertuples(index=False):
        flow, began = FlowCondition(*row), time.process_time()
        try:
            error, scatter = _oscillation(packing, flow) if flow.kind == "oscillation" else _flow(packing, flow, linear)
        except (ConvergenceError, InputError):  # no answer, or a frequency that no run reaches
            continue
        facts = {"part": one["part"], "seed": one["seed"], "n": packing.n, "pressure": mean_overlap(packing)}
        yield flow._asdict() | facts | {"error": error, "scatter": scatter, "seconds": time.process_time() - began}


def _oscillation(packing: Packing, wanted: FlowCondition) -> tuple[float, float]:
    """Relative error of G* without running, and the number of cycles that running took."""
    stokes, alpha = wanted.alpha == CONDITIONS.stokes, wanted.alpha or 1.0
    law = StokesDrag(eta_f=0.0) if stokes else ContactDamping(wanted.beta, alpha=alpha)
    amplitude = wanted.amplitude * mean_overlap(packing)
    omega = (wanted.drag * amplitude ** (1.0 - alpha)) ** (1.0 / alpha)
    run = oscillate(packing, omega, amplitude, law, tolerance=TOLERANCE, cycles=CYCLES)
    true = complex(run.storage, run.loss)
    small = complex_modulus(packing, [omega], law) if stokes else None
    found = small or nonlinear_modulus(packing, [omega], law, amplitude=amplitude)
    simple = complex(found.storage[0], found.loss[0])
    return abs(simple - true) / abs(true), run.cycles


def _flow(packing: Packing, wanted: FlowCondition, linear: dict[float, float]) -> tuple[float, float]:
    """Relative error of linear drag at the rate to the power alpha; and of the mean at unit strain."""
    if wanted.drag not in linear:
        linear[wanted.drag] = float(flow_curve(packing, [wanted.drag], ContactDamping(wanted.beta), **STEADY).stress[0])
    law = ContactDamping(wanted.beta, alpha=wanted.alpha)
    curve = flow_curve(packing, [wanted.drag ** (1.0 / wanted.alpha)], law, **STEADY)
    error = 0.0 if wanted.alpha == 1.0 else abs(linear[wanted.drag] / curve.stress[0] - 1.0)
    return float(error), float(curve.stress_stderr[0] / curve.stress[0] * STEADY["strain"] ** 0.5)


def reduce_runs(rows: pd.DataFrame) -> FlowErrors:
    """Errors that the runs promise, with what the checks of them say."""
    errors = FlowErrors({"grids": _grids(rows)})
    errors.content["kept"] = {kind: checks_kept(errors, rows[rows["kind"] == kind]) for kind in KINDS}
    scatter = rows.loc[(rows["kind"] == "flow") & (rows["n"] == CONDITIONS.size), "scatter"]
    errors.content["scatter"] = float(scatter.mean())
    parts = {kind: rows[rows["kind"] == kind] for kind in KINDS}
    errors.content["measured"] = {kind: _ranges(part) for kind, part in parts.items() if len(part)}
    return errors


def checks_kept(errors: FlowErrors, rows: pd.DataFrame) -> tuple[int, int]:
    """How many checks, on other packings at random conditions, stayed below the error promised, and of how many for
    which one was."""
    checks = rows[rows["part"] == Part.CHECK]
    promised = promises(errors, checks)
    known = np.isfinite(promised)
    return int(np.sum(checks["error"].to_numpy()[known] <= promised[known])), int(known.sum())


def promises(errors: FlowErrors, rows: pd.DataFrame) -> Array:
    """(m,) what is promised for some runs."""
    flows = [FlowCondition(*row) for row in rows[["kind", *_CONDITION, "beta"]].itertuples(index=False)]
    return np.array([errors.promise(flow) for flow in flows])


def _grids(rows: pd.DataFrame) -> dict[str, Any]:
    rows = rows[rows["part"].isin([Part.CALIBRATE, Part.MANY])]
    rows = rows[(rows["kind"] != "flow") | (rows["alpha"] < 1.0)]  # linear drag beside itself has no error
    found = {}
    for kind in KINDS:
        for name, law in (
            ("stokes", rows["alpha"] == CONDITIONS.stokes),
            ("contact", rows["alpha"] != CONDITIONS.stokes),
        ):
            if len(part := rows[(rows["kind"] == kind) & law]):
                found[f"{kind}, {name}"] = _upper_errors(part)
    return found


def _upper_errors(rows: pd.DataFrame) -> dict[str, Any]:
    """Error that is promised over alpha, drag and amplitude. At a condition with enough runs it is the error that few
    of them exceed. Elsewhere the median counts, times the ratio to it that few runs exceed, of all drags at one
    amplitude together."""
    error, places = rows["error"].clip(lower=_FLOOR), [rows[name] for name in _CONDITION]
    median = error.groupby(places).transform("median")
    alike = [rows["alpha"].isin([CONDITIONS.stokes, 1.0]), rows["amplitude"]]  # power laws together, and drags
    pooled = median * _quantile((error / median).groupby(alike))
    own = _quantile(error.groupby(places))
    promised = own.where(np.isfinite(own), pooled).groupby(places).first().unstack("amplitude")
    axes = {name: np.unique(rows[name].to_numpy(dtype=np.float64)).tolist() for name in _CONDITION}
    every = pd.MultiIndex.from_product([axes["alpha"], axes["drag"]])
    grid = promised.reindex(every).bfill(axis=1).cummax(axis=1)  # errors grow with amplitude
    upper = grid.to_numpy().reshape(len(axes["alpha"]), len(axes["drag"]), len(axes["amplitude"]))
    known: Any = upper.astype(object)
    known[~np.isfinite(upper)] = None
    return axes | {"error": known.tolist()}


def _quantile(errors: Any) -> Any:
    """What few of a group exceed, for each of its rows."""
    return errors.transform(lambda group: exceeded_by_few(group.to_numpy()))


def _ranges(rows: pd.DataFrame) -> dict[str, Any]:
    """Conditions of the runs of one kind."""

    def ends(values: Iterable[float]) -> list[float]:
        return [float(min(values)), float(max(values))]

    power = rows[~rows["alpha"].isin([CONDITIONS.stokes, 1.0])]
    linear = rows.drop(power.index)
    return {
        "n": int(rows["n"].min()),
        "pressure": ends(rows["pressure"]),
        "alpha": ends(rows.loc[rows["alpha"] != CONDITIONS.stokes, "alpha"]),
        "drag": ends(rows["drag"]),
        "power_drag": float(power["drag"].min()),
        "linear_amplitude": float(linear["amplitude"].max()),
        "power_amplitude": float(power["amplitude"].max()),
    }
