"""Check the intervals of `jamlab.estimate`: random requests, answered from packings that its table does not know.

Answers are held against the droplets of the reference data, each packing interpolated between its states to the packing
fraction of the request. Packings of a request are drawn from a pool, a table of other seeds and other packing
fractions, or from one half of the reference packings, whose other half is the truth then.
"""

import itertools

import numpy as np
import pandas as pd

from jamlab.errors import StorageError
from jamlab.estimates.estimate import ENSEMBLE_QUANTITIES, finite, plan_mean, reference_way
from jamlab.estimates.ways import ONSET, N, free_shape, read_ways, scatter
from jamlab.statistics.confidence import STANDARD_ERRORS

ERRORS = (0.5, 1.5)  # asked for, in units of the scatter of droplets: some 16 to 4 packings


# a request and what was asked for; how it was met, the cost planned and seen; estimate and half the width of its
# interval; mean of the reference, its standard error, and over how many packings it is
COLUMNS = (
    *("request", "quantity", "rho", "error", "way", "packings", "expected", "seconds", "value", "reached"),
    *("truth", "truth_error", "truth_packings"),
)


def blind_trial(pool, truth, count, seed):
    """Ask for means of `pool` at random, and hold the answers against the tables of the truth: a row for each."""
    rng = np.random.default_rng(seed)
    table = {way: record for way, record in read_ways().items() if way in pool or way == reference_way()}
    droplets, levels = table[reference_way()], next(iter(pool.values())).levels
    rows = []
    for k in range(count):
        quantity = str(rng.choice([name for name in ENSEMBLE_QUANTITIES if name != "b"]))  # no truth of B ships
        rho = float(rng.choice(levels))
        deviation = scatter(droplets, quantity, rho).deviation
        error = float(f"{deviation * np.exp(rng.uniform(*np.log(ERRORS))):.2g}")
        plan = plan_mean(quantity, None if quantity == ONSET else rho, error, table=table)
        values = rng.permutation(droplets_at(truth, quantity, rho))
        if plan.choice.way == reference_way():
            drawn, values = values[::2], values[1::2]
            make = _draw(drawn, np.full(len(drawn), plan.scatter.seconds), rng)
        else:
            make = _draw(*_column(pool[plan.choice.way], quantity, rho), rng)
        made = plan.collect(error, make)
        good = finite(made)
        value = float(np.mean(good)) + plan.choice.correction[quantity]
        true = (float(values.mean()), float(values.std(ddof=1) / np.sqrt(len(values))), len(values))
        cost = (len(good), plan.choice.seconds, sum(seconds for _, seconds in made))
        rows.append((k, quantity, rho, error, str(plan.choice.way), *cost, value, plan.ci95(good), *true))
    return pd.DataFrame(rows, columns=COLUMNS)


def holds(answers, *, truth_errs=True):
    """Whether each interval holds the truth, which has an error of its own."""
    own = STANDARD_ERRORS * answers["truth_error"] * truth_errs
    return (answers["value"] - answers["truth"]).abs() <= np.hypot(answers["reached"], own)


def summarize(answers):
    """Share of intervals that hold the truth, in all and by quantity and way, and of costs near the expected."""
    held, ratio = holds(answers), answers["seconds"] / answers["expected"]
    found = {
        "holds": float(held.mean()),
        "holds the truth without its error": float(holds(answers, truth_errs=False).mean()),
        "error as asked for": float((answers["reached"] <= answers["error"]).mean()),
        "cost within 1.5": float(ratio.between(1 / 1.5, 1.5).mean()),
    }
    for kind in ("quantity", "way"):
        found |= {str(name): float(share) for name, share in held.groupby(answers[kind]).mean().items()}
    return found


def droplets_at(tables, quantity, rho):
    """(m,) a quantity of every packing of 64 droplets at rho, between two states; those that have it.

    Sides of voids follow from z by Euler's relation, 2z/(z - 2): within 0.001 of those counted, at all rho from 0.845.
    """
    if quantity == ONSET:
        return np.asarray(_of_droplets(tables.onset)["rho_J"])
    column = {"d_shape_factor": "shape_factor", "void_sides": "z"}.get(quantity, quantity)
    found = []
    for _, packing in _of_droplets(tables.states).sort_values("rho").groupby("seed"):
        x, y = packing["rho"].to_numpy(), packing[column].to_numpy()
        if x[0] <= rho <= x[-1]:
            k = max(int(np.searchsorted(x, rho)), 1)
            found.append(float(np.interp(rho, x[k - 1 : k + 1], y[k - 1 : k + 1])))
    values = np.array([value for value in found if np.isfinite(value)])
    if quantity == "void_sides":
        return np.asarray(2 * values / (values - 2))
    return values - free_shape(reference_way().nv) if quantity == "d_shape_factor" else values


def _of_droplets(table):
    return table[(table["model"] == "dp") & (table["n"] == N)]


def _column(record, quantity, rho):
    """(m,) values and seconds of a way at one of its levels."""
    k = 0 if quantity == ONSET else int(np.flatnonzero(np.isclose(record.levels, rho))[0])
    return record.values[quantity][:, k], record.seconds[:, k]


def _draw(values, seconds, rng):
    order = iter(rng.permutation(len(values)).tolist())

    def make(count):
        if len(drawn := list(itertools.islice(order, count))) < count:
            raise StorageError(f"the pool has {len(values)} packings of this way, too few: measure more seeds")
        return [(float(values[k]), float(seconds[k])) for k in drawn]

    return make
