"""How large plastic events are: the distribution over an ensemble of packings, with its exponent.

In steady shear at zero rate sizes follow p(s) ~ s^-tau up to a cutoff that grows with the number of particles, so that
mean sizes go as powers of it (Karmakar, Lerner & Procaccia, Phys. Rev. E 82, 055103 (2010); Salerno & Robbins, Phys.
Rev. E 88, 062206 (2013)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from jamlab.arrays import Array, Indices
from jamlab.checks import checked, is_number
from jamlab.errors import InputError, named
from jamlab.flow.quasistatic_run import QuasistaticShear
from jamlab.mechanics.like_packings import check_distinct, group_by_kind
from jamlab.packing.result import Result
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLACK, BLUE
from jamlab.statistics.confidence import bootstrap
from jamlab.statistics.rows_of_one_kind import Campaign, DataFrame, Select, check_packings_once, rows_of_one_kind
from jamlab.statistics.size_distribution import SizeLaw, fit_sizes

SizeOf = Literal["energy", "stress_drop", "participation"]
RESAMPLES = 200  # the ends of a 95 % interval to a fifth of its width
_NAMES = {
    "energy": "energy lost $s$",
    "stress_drop": "stress drop $s$",
    "participation": "particles that take part $s$",
}
TABLE = "plastic_events"  # of a campaign
# columns that may differ between events of one kind
_MEASURED = (
    *(
        "task",
        "seed",
        "n_events",
        "phi",
        "rho",
        "pressure",
        "converged",
        "strain",
        "stress_drop",
        "released",
        "event_width",
    ),
    *("energy", "participation", "contacts_lost", "contacts_gained", "neighbors_lost", "neighbors_gained", "t1"),
)


@dataclass(frozen=True, eq=False)
class EventSizes(Result):
    """Sizes of plastic events, m of them, and the law p(s) ~ s^-exponent exp(-s/cutoff) through those above `least`.

    Intervals of 95 % are over packings, by bootstrap; nan of a single one.

    Attributes:
        sizes: (m,) ascending.
        packing_number: (m,) packing of each of them.
        quantity: what is taken for the size.
        exponent, exponent_low, exponent_high: tau and its interval.
        cutoff, cutoff_low, cutoff_high: of large sizes; infinite without.
        least: smallest size of the fit.
        fitted: number of sizes of the fit.
        distance: largest difference of the cumulative distributions of law and data, of Kolmogorov and Smirnov.
        mean, mean_low, mean_high: mean of all sizes.
        packings: number of packings.
        left_out: number of events without a positive size, as where stress rises.
        unit: of sizes, for labels.

    Example:
        >>> p = [jamlab.pack(16, 1e-2, seed) for seed in (1, 2, 3, 4)]
        >>> runs = [jamlab.quasistatic_shear(each, 0.2, strain_step=1e-2) for each in p]
        >>> s = jamlab.event_sizes(runs, truncated=False)
        >>> s.packings, len(s.sizes) == sum(len(run.events) for run in runs), bool(1 < s.exponent < 2)
        (4, True, True)
    """

    _rows = ("sizes", "packing_number")

    sizes: Array
    packing_number: Indices
    quantity: SizeOf
    exponent: float
    exponent_low: float
    exponent_high: float
    cutoff: float
    cutoff_low: float
    cutoff_high: float
    least: float
    fitted: int
    distance: float
    mean: float
    mean_low: float
    mean_high: float
    packings: int
    left_out: int
    unit: str = field(default="", repr=False)

    @property
    def law(self) -> SizeLaw:
        """The law through the sizes."""
        return SizeLaw(self.exponent, self.cutoff, self.least, self.fitted, self.distance)

    @drawn('Line2D of the sizes, such as color="k"')
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the share of events that are larger than a size, and the law through them.

        >>> p = [jamlab.pack(16, 1e-2, seed) for seed in (1, 2, 3, 4)]
        >>> runs = [jamlab.quasistatic_shear(each, 0.2, strain_step=1e-2) for each in p]
        >>> ax = jamlab.event_sizes(runs, truncated=False).plot()
        """
        count = len(self.sizes)
        label = f"{count} events of {self.packings} packing{'s' * (self.packings > 1)}"
        look = {"color": BLUE, "linewidth": 1.6, "drawstyle": "steps-post", "label": label}
        axes.loglog(self.sizes, (count - np.arange(count)) / count, **merged_line(look, style))
        s = np.geomspace(self.least, self.sizes[-1], 200)
        known = np.isfinite(self.exponent_high - self.exponent_low)
        within = f" [{self.exponent_low:.2f}, {self.exponent_high:.2f}]" if known else ""
        name = rf"$\tau$ = {self.exponent:.2f}{within}, from {self.least:.2g} on"
        axes.loglog(s, self.fitted / count * self.law.beyond(s), color=BLACK, linewidth=1.0, label=name)
        axes.set_ylim(bottom=0.5 / count)
        label_axes(axes, in_unit(_NAMES[self.quantity], self.unit), "share of events that are larger")
        axes.legend(fontsize=LEGEND)


@checked
def event_sizes(
    runs: QuasistaticShear | Sequence[QuasistaticShear] | Campaign | DataFrame,
    quantity: SizeOf = "energy",
    *,
    discard: float = 0.0,
    least_size: float | None = None,
    truncated: bool = True,
    select: Select | None = None,
) -> EventSizes:
    """Collect the sizes of plastic events of an ensemble, and fit their distribution by maximum likelihood.

    Args:
        runs: quasi-static shear of packings of one kind, or a campaign with the observable "plastic_events", or its
            table.
        quantity: "energy", lost by the whole packing; "stress_drop"; "participation", the number of particles that take
            part, which runs know that were given `event_width`.
        discard: path of strain at the start whose events are left out, both directions added.
        least_size: smallest size of the fit. Default: the one from which on the law is closest to the data, see
            `jamlab.statistics.size_distribution.fit_sizes`.
        truncated: whether large sizes are cut off exponentially; False fits a power law alone.
        select: of a campaign, column -> value of the rows that are wanted.

    Returns:
        Sizes, exponent, cutoff and mean with intervals over packings.

    Raises:
        InputError: packings of several kinds or one twice, or fewer than ten events to fit.

    Example:
        >>> p = [jamlab.pack(16, 1e-2, seed) for seed in (1, 2, 3, 4)]
        >>> runs = [jamlab.quasistatic_shear(each, 0.2, strain_step=1e-2) for each in p]
        >>> s = jamlab.event_sizes(runs, "energy", truncated=False)
        >>> s.quantity, bool(s.exponent_low < s.exponent < s.exponent_high)
        ('energy', True)
    """
    if not (is_number(discard) and discard >= 0):
        raise InputError(f"{named('discard', discard)}: give a strain, 0 or more")
    if isinstance(runs, Campaign | DataFrame):
        groups, unit = _of_rows(runs, quantity, discard, select), ""
    elif select is not None:
        raise InputError("select: applies to a campaign; choose among runs by hand")
    else:
        each = [runs] if isinstance(runs, QuasistaticShear) else [*runs]
        groups, unit = _of_runs(each, quantity, discard)
    kept = [sizes[sizes > 0] for sizes in groups]
    number = np.repeat(np.arange(len(kept)), [len(sizes) for sizes in kept])
    every = np.concatenate(kept) if kept else np.zeros(0)
    law = fit_sizes(every, least_size, truncated=truncated)

    def statistic(drawn: list[Array]) -> Array:
        sizes = np.concatenate([kept[int(k)] for k in drawn[0]])
        found = fit_sizes(sizes, law.least, truncated=bool(np.isfinite(law.cutoff)))
        return np.array([found.exponent, 1 / found.cutoff, sizes.mean()])

    found = bootstrap([np.arange(len(kept))], statistic, resamples=RESAMPLES)
    order = np.argsort(every, kind="stable")
    return EventSizes(
        sizes=every[order],
        packing_number=number[order],
        quantity=quantity,
        exponent=law.exponent,
        exponent_low=float(found.low[0]),
        exponent_high=float(found.high[0]),
        cutoff=law.cutoff,
        cutoff_low=_inverse(found.high[1]),
        cutoff_high=_inverse(found.low[1]),
        least=law.least,
        fitted=law.count,
        distance=law.distance,
        mean=float(every.mean()),
        mean_low=float(found.low[2]),
        mean_high=float(found.high[2]),
        packings=len(kept),
        left_out=sum(len(sizes) for sizes in groups) - len(every),
        unit=unit,
    )


def _inverse(value: float) -> float:
    """Of a cutoff, which is infinite where a power law alone fits as well."""
    return float("inf") if value <= 0 else float(1 / value)


def _of_runs(runs: list[QuasistaticShear], of: SizeOf, discard: float) -> tuple[list[Array], str]:
    """Sizes of the events of each run, and their unit."""
    if not runs:
        raise InputError("runs: give one or more")
    first = [run.frames[0] for run in runs]
    if len(kinds := group_by_kind(first)) > 1:
        raise InputError(
            f"runs of {len(kinds)} kinds have no common distribution: {'; '.join(kinds)}. Give those of one"
        )
    check_distinct(dict(enumerate(first)), "runs")
    found = []
    for run in runs:
        late = run.path[run.event] > discard
        found.append(np.asarray(getattr(run.events, of), dtype=np.float64)[late])
    events = runs[0].events
    return found, {"energy": events.energy_unit, "stress_drop": runs[0].unit, "participation": ""}[of]


def _of_rows(source: Campaign | DataFrame, of: SizeOf, discard: float, select: Select | None) -> list[Array]:
    """Sizes of the events of each packing of a campaign."""
    rows = rows_of_one_kind(source, TABLE, select, _MEASURED, (of, "strain", "task", "state", "seed"))
    check_packings_once(rows, "event_sizes")
    return [part[of].to_numpy(np.float64)[part["strain"].abs() > discard] for _, part in rows.groupby("task")]
