"""A study of plastic events under quasi-static shear: the distribution of their sizes, and how mean sizes change with
the number of disks."""

from functools import partial
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.flow.quasistatic_shear import quasistatic_shear
from jamlab.plotting import in_unit
from jamlab.protocols.target_pressure import pack
from jamlab.statistics.power_laws import fit_exponent
from jamlab.statistics.size_distribution import fit_sizes
from studies.ensemble_tables import EnsembleTables
from studies.ensembles import bootstrap, mean_over_packings
from studies.panels import Drawing, drawing, label, scale, size_style, style, write_interval
from studies.papers.statements import caption
from studies.study import Study
from studies.tables import Task

PRESSURE, STRAIN, STEP, WIDTH = 1e-2, 0.2, 5e-3, 5e-4
SIZES = (16, 32, 64)
SEEDS, BLOCK = 20, 4  # packings of a size, and of one task
STEADY = 0.05  # strain from which on events count
LEAST = 1e-6  # energy k d^2 from which on sizes are fitted
# exponents of mean energy and mean stress drop in N, 2D, N = 484 to 20 164: Karmakar, Lerner & Procaccia, Phys. Rev. E
# 82, 055103 (2010)
PUBLISHED = {"energy": 1 / 3, "stress_drop": -2 / 3}


def measure_events(n: int, first: int) -> list[dict[str, Any]]:
    """Shear packings at a fixed area: strain, energy, stress drop and participants of every event, a row each."""
    rows = []
    for seed in range(first, first + BLOCK):
        run = quasistatic_shear(pack(n, PRESSURE, seed), STRAIN, STEP, event_width=WIDTH)
        events, row = run.events, {"n": n, "seed": seed, "missed": int((~run.converged).sum())}
        columns = ("strain", "stress_drop", "energy", "participation", "contacts_lost", "contacts_gained", "kind")
        for values in zip(*(getattr(events, name) for name in columns), strict=True):
            rows.append({**row, **dict(zip(columns, values, strict=True))})
    return rows


def _tasks() -> dict[str, Task]:
    starts = range(1, SEEDS + 1, BLOCK)
    return {f"{n} {first}": partial(measure_events, n, first) for n in SIZES for first in starts}


def _power(groups: list[Array]) -> float:
    """Exponent in N of the mean over events, of which each packing has a sum and a number."""
    return fit_exponent(np.array(SIZES, dtype=np.float64), np.array([g[:, 0].sum() / g[:, 1].sum() for g in groups]))


def draw_events(tables: EnsembleTables) -> Drawing:
    """Draw the share of events above a size with the law through it, and mean sizes over the number of disks."""
    rows = tables.read("plastic-events")
    rows = rows[rows["strain"] > STEADY]
    out, axes = drawing("plastic-events", 2, 2, 4.6, 3.6)
    scale(*axes)
    for n in SIZES:
        of = rows[rows["n"] == n]
        each = [part["energy"].to_numpy() for _, part in of.groupby("seed")]

        def tau(groups: list[Array], each: list[Array] = each) -> list[float]:
            law = fit_sizes(np.concatenate([each[int(k)] for k in groups[0]]), LEAST)
            return [law.exponent, 1 / law.cutoff]

        found, energies = bootstrap([np.arange(len(each))], tau), np.sort(of["energy"].to_numpy())
        out.values[f"tau of energies, N = {n}"] = found[0]
        share = (len(energies) - np.arange(len(energies))) / len(energies)
        name = rf"N = {n}, $\tau$ = {found.value[0]:.2f}"
        out.curve(axes[0], name, energies, share, **size_style(n) | {"marker": "", "linestyle": "-"})
        law = fit_sizes(energies, LEAST)
        at = np.geomspace(LEAST, energies[-1], 60)
        axes[0].plot(at, law.count / len(energies) * law.beyond(at), "k:", linewidth=0.9)
    for k, (column, text, unit) in enumerate((("energy", "energy", "k d²"), ("stress_drop", "stress drop", "k"))):
        groups = [
            np.array([[part[column].sum(), len(part)] for _, part in rows[rows["n"] == n].groupby("seed")])
            for n in SIZES
        ]
        means = bootstrap(groups, lambda g: [each[:, 0].sum() / each[:, 1].sum() for each in g])
        out.values[f"exponent in N of the mean {text}"] = power = bootstrap(groups, _power)
        out.curve(axes[1 + k], f"exponent {write_interval(power)}", SIZES, means, band=False, **style(k))
        line = means.value[0] * (np.array(SIZES) / SIZES[0]) ** PUBLISHED[column]
        axes[1 + k].plot(SIZES, line, "k--", linewidth=0.9, label=f"published {PUBLISHED[column]:.2f}")
        label(axes[1 + k], "number of disks $N$", in_unit(f"mean {text} of an event", unit), loc="best")
    taken = [[part["participation"].mean() for _, part in rows[rows["n"] == n].groupby("seed")] for n in SIZES]
    means = mean_over_packings([np.array(each) for each in taken])
    out.curve(axes[3], r"by $D^2_{\min}$", SIZES, means, band=False, **style(2))
    axes[0].set_ylim(2e-3, 1.2)
    label(axes[0], in_unit("energy of an event", "k d²"), "share of events that are larger", loc="lower left")
    label(axes[3], "number of disks $N$", "disks that take part in an event", loc="best")
    t1 = float((rows["kind"] == "T1").mean())
    rising = [100 * float((rows.loc[rows["n"] == n, "stress_drop"] <= 0).mean()) for n in SIZES]
    numbers = {"p": PRESSURE, "made": rows.groupby("n")["seed"].nunique().min(), "events": len(rows), "t1": 100 * t1}
    numbers |= {"first": rising[0], "last": rising[-1], "fewest": SIZES[0], "most": SIZES[-1]}
    out.caption = caption(out.name, **numbers, width=WIDTH, least=LEAST, missed=int(rows["missed"].max()))
    return out


STUDY = Study("plastic-events", "Sizes of plastic events", _tasks(), draw_events)
