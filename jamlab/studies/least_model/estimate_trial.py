"""A blind trial of `jamlab.estimate`: random requests, really run, against ensembles that its table does not know.

The truth is the mean over the droplet packings of the reference data, each interpolated between its states to the
packing fraction of the request. Results are kept as they come; a trial that was stopped goes on.
"""

import csv
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from jamlab.arrays import Array
from jamlab.estimates.ensemble_plan import ENSEMBLE_QUANTITIES, EnsemblePlan, reference_way
from jamlab.estimates.ensemble_way import free_shape
from jamlab.estimates.estimate import estimate
from jamlab.estimates.way_errors import scatter
from jamlab.estimates.way_table import ONSET, N, read_ways
from jamlab.statistics.confidence import STANDARD_ERRORS
from jamlab.studies.cpu_time import one_core
from jamlab.studies.ensemble_tables import EnsembleTables

if TYPE_CHECKING:
    import pandas as pd


RHO = (0.84, 0.98)
ERRORS = (0.5, 1.5)  # in units of the scatter of droplets: some 16 to 4 packings
ALWAYS = 50  # packings of droplets from the start, to compare the cost with
_FIRST_SEED = 500_000
_TRUTH = ("truth", "truth_error", "truth_packings")


class Request(NamedTuple):
    """What is asked for."""

    quantity: str
    rho: float
    error: float
    seed: int


class Answer(NamedTuple):
    """A request with what came of it.

    Attributes:
        request: its number.
        quantity, rho, error, seed: what was asked for.
        way, packings, expected, seconds: how it was met, and the cost, planned and seen.
        value, reached: estimate, and half the width of its interval.
        always: seconds of 50 packings of droplets from the start.
        run: "run", or "resampled": packings drawn from the campaign, at the table's cost.
    """

    request: int
    quantity: str
    rho: float
    error: float
    seed: int
    way: str
    packings: int
    expected: float
    seconds: float
    value: float
    reached: float
    always: float
    run: str = "run"


class Verdict(NamedTuple):
    """An answer beside the truth.

    Attributes:
        answer: what was estimated.
        truth, error, packings: mean of the campaign, its standard error, and over how many it is.
    """

    answer: Answer
    truth: float
    error: float
    packings: int


def draw_requests(count: int, seed: int) -> list[Request]:
    """Draw quantity, rho and error at random."""
    rng = np.random.default_rng(seed)
    names = list(ENSEMBLE_QUANTITIES)
    found = []
    for k in range(count):
        quantity = names[rng.integers(len(names))]
        rho = round(float(rng.uniform(*RHO)), 4)
        deviation = scatter(read_ways()[reference_way()], quantity, rho).deviation
        error = float(f"{deviation * np.exp(rng.uniform(*np.log(ERRORS))):.2g}")
        found.append(Request(quantity, rho, error, _FIRST_SEED + k))
    return found


def run_trial(
    out: Path,
    requests: Sequence[Request],
    *,
    progress: Callable[[str], None] | None = None,
) -> list[Answer]:
    """Run requests, and add their answers to a CSV file; those that it has already are left out."""
    done = {a.request for a in read_answers(out)} if out.exists() else set()
    with one_core():
        for k, request in enumerate(requests):
            if k in done:
                continue
            if progress is not None:
                progress(f"{k}: {request}")
            made = estimate(request.quantity, request.rho, request.error, seed=request.seed)
            answer = _answer(k, request, made.choice, made.packings, made.seconds, made.value, made.error)
            with out.open("a", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                if file.tell() == 0:
                    writer.writerow(Answer._fields)
                writer.writerow([f"{x:.6g}" if isinstance(x, float) else x for x in answer])
    return read_answers(out) if out.exists() else []


def read_answers(path: Path) -> list[Answer]:
    """Read the answers of a trial."""
    with path.open(newline="", encoding="utf-8") as file:
        return [_parse(row) for row in csv.DictReader(file)]


def write_verdicts(path: Path, verdicts: Sequence[Verdict]) -> None:
    """Write a trial as CSV: every answer with the truth, in the order of the requests."""
    rows = [(*v.answer, v.truth, v.error, v.packings) for v in sorted(verdicts, key=lambda v: v.answer.request)]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow((*Answer._fields, *_TRUTH))
        writer.writerows([f"{x:.6g}" if isinstance(x, float) else x for x in row] for row in rows)


def read_verdicts(path: Path) -> list[Verdict]:
    """Read what `write_verdicts` wrote."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    truths = [[row.pop(name) for name in _TRUTH] for row in rows]
    return [Verdict(_parse(row), float(t), float(e), int(n)) for row, (t, e, n) in zip(rows, truths, strict=True)]


def judge(answers: Sequence[Answer], tables: EnsembleTables) -> list[Verdict]:
    """Set answers beside the means over the droplets of some tables, see `jamlab.studies.ensemble_tables`."""
    return [_verdict(a, droplets_at(tables, a.quantity, a.rho)) for a in answers]


def summarize(verdicts: Sequence[Verdict]) -> dict[str, float]:
    """Shares of the answers that hold, that cost what was expected, and what they cost against always 50 droplets."""
    answers = [v.answer for v in verdicts]
    distance = np.array([abs(v.answer.value - v.truth) for v in verdicts])
    reached = np.array([a.reached for a in answers])
    with_truth = np.hypot(reached, [STANDARD_ERRORS * v.error for v in verdicts])
    ratio = np.array([a.seconds / a.expected for a in answers if a.run == "run"])
    saved = np.array([a.seconds / a.always for a in answers])
    return {
        "requests": len(answers),
        "really run": len(ratio),
        "intervals that hold the truth": float(np.mean(distance <= reached)),
        "with the truth's own error": float(np.mean(distance <= with_truth)),
        "errors met": float(np.mean([a.reached <= a.error for a in answers])),
        "cost within 1.5 of the expected, where run": float(np.mean((ratio >= 1 / 1.5) & (ratio <= 1.5))),
        "cost over always 50 droplets, median": float(np.median(saved)),
        "cost over always 50 droplets, worst": float(np.max(saved)),
        "seconds of a request, median": float(np.median([a.seconds for a in answers])),
        "packings of a request over those of the truth, median": float(
            np.median([v.answer.packings / v.packings for v in verdicts])
        ),
    }


def droplets_at(tables: EnsembleTables, quantity: str, rho: float) -> Array:
    """(m,) a quantity of every packing of 64 droplets at rho, between two states; those that have it.

    Sides of voids follow from z by Euler's relation, 2z/(z - 2): within 0.001 of those counted, at all rho from 0.845.
    """
    if quantity == ONSET:
        return np.asarray(_of_droplets(tables.onset)["rho_J"])
    column = {"a": "shape", "void_sides": "z"}.get(quantity, quantity)
    found = []
    for _, packing in _of_droplets(tables.states).sort_values("rho").groupby("seed"):
        x, y = packing["rho"].to_numpy(), packing[column].to_numpy()
        if x[0] <= rho <= x[-1]:
            k = max(int(np.searchsorted(x, rho)), 1)
            found.append(float(np.interp(rho, x[k - 1 : k + 1], y[k - 1 : k + 1])))
    values = np.array([value for value in found if np.isfinite(value)])
    if quantity == "void_sides":
        return np.asarray(2 * values / (values - 2))
    return values - free_shape(reference_way().nv) if quantity == "a" else values


def _of_droplets(table: "pd.DataFrame") -> "pd.DataFrame":
    return table[(table["model"] == "dp") & (table["n"] == N)]


def _answer(
    k: int, request: Request, plan: EnsemblePlan, packings: int, seconds: float, value: float, reached: float
) -> Answer:
    droplets = scatter(read_ways()[reference_way()], request.quantity, request.rho)
    always = ALWAYS * droplets.seconds / droplets.share
    return Answer(k, *request, str(plan.way), packings, plan.seconds, seconds, value, reached, always)


def _verdict(answer: Answer, values: Array) -> Verdict:
    return Verdict(answer, float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values))), len(values))


def _parse(row: dict[str, str]) -> Answer:
    kinds = Answer.__annotations__
    return Answer(**{name: kinds[name](value) for name, value in row.items()})
