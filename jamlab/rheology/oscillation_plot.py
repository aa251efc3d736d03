"""Draw responses in oscillating shear: rescaled spectra, Maxwell elements, correlations of displacement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from jamlab.errors import ConvergenceError
from jamlab.plotting.axes import LEGEND, in_unit, label_axes, merged
from jamlab.plotting.palette import BLACK, BLUE, ordered_colours

if TYPE_CHECKING:
    from jamlab.rheology.critical_scaling import Collapse
    from jamlab.rheology.displacement_correlation import DisplacementCorrelation
    from jamlab.rheology.relaxation_spectrum import RelaxationSpectrum


def draw_collapse(axes: Axes, found: Collapse, /, **style: Any) -> None:
    """Draw the rescaled curves of every pressure; see `Collapse.plot`."""
    order = np.argsort(found.pressures)
    for colour, k in zip(ordered_colours(len(order)), order, strict=True):
        p = found.pressures[k]
        name = f"$p$ = {p:.3g} {found.unit}"
        for values, fill, label in ((found.storage[k], colour, name), (found.loss[k], "white", None)):
            plain = {"color": colour, "marker": "o", "markersize": 4, "linewidth": 0.8, "label": label}
            look = merged(Line2D, plain, style)
            look.setdefault("markerfacecolor", fill)
            axes.loglog(found.omega / p**found.lam, values / p**found.mu, **look)
    label_axes(axes, r"$\omega\,\tau_1/p^\lambda$", in_unit(r"$G'/p^\mu$ (filled), $G''/p^\mu$ (open)", found.unit))
    axes.legend(title=found.exponents, fontsize=LEGEND, title_fontsize=LEGEND, loc="lower right")  # below all curves


def draw_elements(axes: Axes, spectrum: RelaxationSpectrum, /, **style: Any) -> None:
    """Draw strength over rate of each Maxwell element; see `RelaxationSpectrum.plot`."""
    count = len(spectrum.rates)
    label = f"{count} Maxwell elements\n$G_0$ = {spectrum.g0:.3g}, $\\eta_\\infty$ = {spectrum.eta_inf:.3g}"
    plain = {"color": BLUE, "marker": "o", "markersize": 4, "linestyle": "none", "label": label}
    axes.loglog(spectrum.rates, spectrum.strengths, **merged(Line2D, plain, style))
    label_axes(axes, r"relaxation rate $\lambda_i\,\tau_1$", in_unit("strength $g_i$", spectrum.unit))
    axes.legend(fontsize=LEGEND)


def draw_correlation(axes: Axes, found: DisplacementCorrelation, /, **style: Any) -> None:
    """Draw C over distance, and where it is zero; see `DisplacementCorrelation.plot`."""
    try:
        label = f"first zero at {found.length:.3g} {found.unit}".rstrip()
    except ConvergenceError:
        label = "no zero within half the box"
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    plain = {"color": BLUE, "marker": "o", "markersize": 4, "label": label}
    axes.plot(found.delta, found.correlation, **merged(Line2D, plain, style))
    label_axes(axes, in_unit(r"distance along the flow $\delta$", found.unit), r"correlation $C(\delta)$ of $u_y$")
    axes.legend(fontsize=LEGEND)
