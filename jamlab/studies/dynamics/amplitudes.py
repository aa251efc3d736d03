"""Draw G' and G'' of oscillation against amplitude, and the amplitudes at which disks soften and yield."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from jamlab.arrays import Array
from jamlab.errors import InputError
from jamlab.plotting.palette import BLACK, BLUE, RED
from jamlab.statistics.bootstrap import Interval
from jamlab.statistics.published_numbers import SOFTENING_EXPONENT
from jamlab.studies.dynamics.steady_flows import balanced_disks, draw_mean
from jamlab.studies.ensemble_tables import EnsembleTables
from jamlab.studies.ensembles import average, bootstrap, of_packings, select_usual, side_by_side
from jamlab.studies.panels import Drawing, drawing, label, scale, style

AMPLITUDE = r"amplitude of the strain $\gamma_0$"
SOFT, YIELDED = 0.7, 0.1  # of the storage modulus at small amplitude that is left; 0.9 is lost in noise of 64 disks


def amplitude_sweeps(tables: EnsembleTables) -> Drawing:
    """G' and G'' against the amplitude at three frequencies, with softening and yielding against pressure."""
    table = _sweeps(tables.oscillation)
    frequencies, pressures = (sorted(table[name].unique()) for name in ("omega", "target_pressure"))
    out, axes = drawing("dynamics-amplitudes", 1, len(frequencies) + 1, 4.3, 3.9)
    for part, omega in zip(axes, frequencies, strict=False):
        scale(part)
        for k, pressure in enumerate(pressures):
            rows = table[(table["omega"] == omega) & (table["target_pressure"] == pressure)]
            for column, line in (("storage", "-"), ("loss", "--")):
                name = f"$p$ = {pressure:g}" if column == "storage" else f"loss, p = {pressure:g}"
                text = name if column == "storage" else None
                look = {**style(k), "linestyle": line, "label": text}
                draw_mean(out, part, name, rows, "amplitude", column, **look)
        label(part, AMPLITUDE, rf"$G'$, dashed $G''$  [k], $\omega\,\tau_1$ = {omega:g}", legend=part is axes[0])
    _draw_limits(out, axes[-1], table[table["omega"] == frequencies[0]], pressures)
    out.caption = (
        f"{int(table['n'].iloc[0])} disks, {table['seed'].nunique()} packings at each pressure p, in units of k, means "
        "with 95 % intervals. Storage modulus, dashed the loss modulus, of the first harmonic at three frequencies. "
        f"Last: amplitude at which {100 * SOFT:.0f} % of the storage modulus are left (softening), and at which "
        f"{100 * YIELDED:.0f} % are (yielding), at the lowest frequency; dashed, in proportion to pressure."
    )
    return out


def _sweeps(table: pd.DataFrame) -> pd.DataFrame:
    rows = select_usual(select_usual(balanced_disks(table), ["n"], None), ["background"], None)
    if rows["amplitude"].nunique() < 3:
        raise InputError("the table oscillation has no three amplitudes of disks: run a campaign with some")
    return rows


def _draw_limits(out: Drawing, axes: Any, table: pd.DataFrame, pressures: list[float]) -> None:
    """Draw the amplitudes of softening and of yielding over pressure, and claim the exponent of softening."""
    scale(axes)
    groups = []
    for pressure in pressures:
        amplitude, storage = of_packings(table[table["target_pressure"] == pressure], "amplitude", "storage")
        groups.append(storage)
    for share, name, look in ((SOFT, "softening", {"color": RED, "marker": "s"}), (YIELDED, "yielding", _YIELD)):
        found = [bootstrap([storage], partial(_limit, amplitude, share)) for storage in groups]
        ends = side_by_side(found)
        out.keep(f"amplitude of {name}", ends, p=pressures)
        out.curve(axes, name, pressures, ends, band=False, **look)
        if name == "softening":
            out.slope(axes, SOFTENING_EXPONENT.value, (pressures[0], pressures[-1]), 0.5 * ends.value[0])
    label(axes, "pressure $p$  [k]", AMPLITUDE)
    exponent: Interval | None = None
    if len(pressures) > 1:
        log_p = np.log(pressures)

        def slope(values: list[Array]) -> float:
            limits = [_falls_to(amplitude, average(each), SOFT) for each in values]
            return float(np.polyfit(log_p, np.log(limits), 1)[0])

        exponent = bootstrap(groups, slope)
    how = f"amplitude at which {100 * SOFT:.0f} % of G' are left, {len(pressures)} pressures, lowest frequency"
    text = "exponent of the softening amplitude over pressure, Boschan et al. 2016"
    out.claim(text, exponent, SOFTENING_EXPONENT, how=how)


_YIELD = {"color": BLUE, "marker": "o", "markeredgecolor": BLACK}


def _limit(amplitude: Array, share: float, groups: list[Array]) -> float:
    return _falls_to(amplitude, average(groups[0]), share)


def _falls_to(amplitude: Array, storage: Array, share: float) -> float:
    """Find the amplitude at which the storage modulus first falls to a share of its first value; nan if never."""
    ratio = storage / storage[0]
    below = np.flatnonzero(ratio < share)
    if not len(below):
        return np.nan
    k = int(below[0])
    part = np.log(ratio[k - 1] / share) / np.log(ratio[k - 1] / max(ratio[k], 1e-3))
    return float(amplitude[k - 1] * (amplitude[k] / amplitude[k - 1]) ** part)
