"""Draw a column of a campaign's table along another: means over packings with their 68 % intervals."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import ArrayLike, NDArray

from jamlab.arrays import Array
from jamlab.campaign.observables import OBSERVABLES
from jamlab.campaign.tables import aggregate, choose_bins
from jamlab.errors import InputError
from jamlab.packing.law_parameters import UNIT_OF_STRESS
from jamlab.plotting.axes import merged
from jamlab.plotting.drawable import LEGEND, in_unit, label_axes
from jamlab.plotting.palette import COLOURS, MODEL_STYLE

if TYPE_CHECKING:
    import pandas as pd


ONE_SIGMA = 0.6827  # level of the interval that reaches one standard error to either side
_FEW = 0.5  # share of the packings below which the mean of those that have a value is that of a selection
_LEGEND_WIDTH = 44  # characters of a line, which fit into axes of 4 inches
_RESAMPLES = 400  # a standard error to 4 %
LABELS = {
    "z": "contact number $z$",
    "rho": r"true packing fraction $\rho$",
    "phi": r"nominal packing fraction $\phi$",
    "d_rho": r"distance from onset $\rho - \rho_J$",
    "d_phi": r"distance from onset $\phi - \phi_J$",
    "pressure": "pressure $p$",
    "target_pressure": "pressure $p$",
    "g": "shear modulus, mean over\ndirections, $G$",
    "g_x": "shear modulus $G_{xy}$",
    "b": "bulk modulus $B$",
    "shape": r"shape factor $\mathcal{A}$",
    "shape_rim": r"shape factor with rim $\mathcal{A}$",
    "void_sides": "mean sides of voids",
    "void_shape": "mean shape factor of voids",
    **{column: label for o in OBSERVABLES.values() for column, label in o.labels.items()},
}
_UNLIKE = ("model", "n", "ensemble", "units")  # what is never averaged over
_STRESSES = frozenset({"pressure", "target_pressure", "g", "g_x", "b"})


def draw_means(
    axes: Axes, frame: pd.DataFrame, value: str, along: str, by: str, bins: ArrayLike | None, /, **style: Any
) -> None:
    """Draw one curve for each value of the column `by`; see `Campaign.plot`."""
    for name in (value, along, by):
        if name not in frame.columns:
            raise InputError(f"the table has no column {name!r}: use one of {', '.join(frame.columns)}")
    if not len(frame):
        raise InputError("no task has a row for this table yet: run the campaign first")
    for name in (value, along):
        if frame[name].dtype.kind not in "biuf":
            raise InputError(f"column {name!r} holds no numbers: plot one that does")
    keys = [by, *(name for name in _UNLIKE if name != by and _differs_within(frame, by, name))]
    found = choose_bins(frame[along].to_numpy(np.float64))
    edges, logarithmic = found if bins is None else (np.asarray(bins, dtype=np.float64), False)
    drawn = 0
    for k, (group, part) in enumerate(frame.groupby(keys, sort=True, dropna=False)):
        means = aggregate(part, [value], (), along=along, bins=edges, confidence=ONE_SIGMA, resamples=_RESAMPLES)
        if len(means):
            means = means[np.isfinite(means[value])]
        plain = MODEL_STYLE.get(str(group[0])) if keys == ["model"] else None
        look = plain or {"color": COLOURS[k % len(COLOURS)], "marker": "os^vD"[k % 5], "label": _name(keys, group)}
        look = merged(Line2D, {"markersize": 6, "linewidth": 1.4, **look}, style)
        notes = [str(look["label"]), *_left_out(part, value, along, edges), *_selection(means, value)]
        look["label"] = "\n".join(
            line for note in notes for line in textwrap.wrap(note, _LEGEND_WIDTH, break_on_hyphens=False)
        )
        if not len(means):
            axes.plot([], [], **look)
            continue
        drawn += len(means)
        x, y, low, high = means[[along, value, f"{value}_low", f"{value}_high"]].to_numpy(np.float64).T
        bars = axes.errorbar(x, y, np.nan_to_num([y - low, high - y]), capsize=2.5, **look)
        if (few := _few(means, value)).any():
            line = bars.lines[0]
            hollow: dict[str, Any] = {
                "marker": line.get_marker(),
                "markersize": line.get_markersize(),
                "color": line.get_color(),
            }
            axes.plot(x[few], y[few], linestyle="none", markerfacecolor="white", **hollow)
    if not drawn:
        raise InputError(f"no state has both {value} and {along}: plot another column, or run the campaign first")
    if logarithmic:
        axes.set_xscale("log")
    label_axes(axes, _label(frame, along), _label(frame, value))
    axes.legend(fontsize=LEGEND, loc="lower left", bbox_to_anchor=(0, 1.0))  # clear of curves and error bars


def _name(keys: list[str], group: tuple[Any, ...]) -> str:
    """What tells a group from the others, such as "soft particles (SP), n = 16"."""
    words = []
    for key, value in zip(keys, group, strict=True):
        known = MODEL_STYLE[value]["label"] if key == "model" and value in MODEL_STYLE else None
        words.append(str(known or (value if key in ("ensemble", "units") else f"{key} = {value}")))
    return ", ".join(words)


def _differs_within(frame: pd.DataFrame, by: str, name: str) -> bool:
    """Whether rows of one group differ in a column: what is unlike gets a curve each, never a mean."""
    return name in frame.columns and bool((frame.groupby(by, dropna=False)[name].nunique() > 1).any())


def _units(frame: pd.DataFrame) -> list[str]:
    """Units of stress that occur."""
    kinds = frame[["model", "units"]].drop_duplicates().itertuples(index=False)
    return list(dict.fromkeys(UNIT_OF_STRESS[model, units] for model, units in kinds))


def _left_out(part: pd.DataFrame, value: str, along: str, edges: Array) -> list[str]:
    """Say in the legend how many rows are not drawn, if any."""
    x = part[along].to_numpy(np.float64)
    outside = ~((x >= edges[0]) & (x < edges[-1]))
    missing = ~np.isfinite(part[value].to_numpy(np.float64)) & ~outside
    counts = ((outside.sum(), "outside the bins"), (missing.sum(), f"without {value}"))
    text = ", ".join(f"{count} {reason}" for count, reason in counts if count)
    return [f"states left out: {text}"] if text else []


def _few(means: pd.DataFrame, value: str) -> NDArray[np.bool_]:
    """Whether a point is the mean of a selection: of fewer than half of its packings, since others have no value."""
    return np.array(means[f"{value}_packings"] < _FEW * means["packings"], dtype=np.bool_)


def _selection(means: pd.DataFrame, value: str) -> list[str]:
    """Say in the legend that some points are means of a selection."""
    if not len(means) or not (few := _few(means, value)).any():
        return []
    have, of = means.loc[few, [f"{value}_packings", "packings"]].to_numpy(np.int64).T
    least = int(np.argmin(have / of))
    return [f"hollow: a selection, down to the {have[least]} of {of[least]} packings that have {value}"]


def _label(frame: pd.DataFrame, column: str) -> str:
    known = column in _STRESSES and {"model", "units"} <= set(frame.columns)
    return in_unit(LABELS.get(column, column), " or ".join(_units(frame)) if known else "")
