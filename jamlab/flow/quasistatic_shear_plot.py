"""Draw the stress of a packing over strain, with its plastic events."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from jamlab.flow.energy_balance import LIMIT, describe_balance
from jamlab.plotting.axes import LEGEND, in_unit, label_axes, merged
from jamlab.plotting.palette import BLACK, BLUE, RED

if TYPE_CHECKING:
    from jamlab.flow.quasistatic_run import QuasistaticShear


def draw_shear(axes: Axes, found: QuasistaticShear, /, **style: Any) -> None:
    """Draw stress over strain, where events end and where no minimum was reached; see `QuasistaticShear.plot`."""
    plain = {"color": BLUE, "linewidth": 1.2, "label": "minima, quasi-static"}
    axes.plot(found.strain, found.stress, **merged(Line2D, plain, style))
    ends = found.strain.searchsorted(found.events.strain)
    if len(ends):
        label = f"{len(ends)} stress drop{'s' * (len(ends) > 1)}"
        axes.plot(found.strain[ends], found.stress[ends], "v", color=RED, markersize=4, label=label)
    if not found.converged.all():
        missed = ~found.converged
        label = f"not converged: {missed.sum()}"
        axes.plot(found.strain[missed], found.stress[missed], "x", color=BLACK, markersize=6, label=label)
    label_axes(axes, r"strain $\gamma$", in_unit(r"shear stress $\sigma$", found.unit))
    legend = axes.legend(
        *axes.get_legend_handles_labels(), title=describe_balance(found.imbalance), fontsize=LEGEND, ncols=3,
        title_fontsize=LEGEND, loc="lower center", bbox_to_anchor=(0.5, 1.0),
    )  # fmt: skip  # above: curves fill the axes
    legend.get_title().set_color(RED if found.imbalance > LIMIT else BLACK)
