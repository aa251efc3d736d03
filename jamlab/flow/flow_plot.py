"""Draw flows in time: start-up, flow curves, Lissajous figures, creep, relaxation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D

from jamlab.flow.flow_run import LIMIT, describe_balance
from jamlab.plotting.axes import LABEL, LEGEND, in_unit, label_axes, merged
from jamlab.plotting.modulus_curves import positive
from jamlab.plotting.palette import BLACK, COLOURS, RED

if TYPE_CHECKING:
    from jamlab.flow.creep import CreepRun
    from jamlab.flow.flow_curve import FlowCurve
    from jamlab.flow.oscillate import Oscillation
    from jamlab.flow.pipkin import Pipkin
    from jamlab.flow.relax_stress import StressRelaxation
    from jamlab.flow.shear_run import ShearRun


def say_balance(axes: Axes, imbalance: float) -> None:
    """Title axes with how well energy is balanced; of several runs, with the worst that is doubtful."""
    doubtful = imbalance > LIMIT
    if doubtful or not axes.get_title("right"):
        words = f"{describe_balance(imbalance)}: DOUBTFUL" if doubtful else describe_balance(imbalance)
        axes.set_title(words, fontsize=LEGEND, loc="right", color=RED if doubtful else BLACK)


def draw_startup(axes: Axes, run: ShearRun, /, label: str = "", **style: Any) -> None:
    """Draw the shear stress (solid) and its elastic part (dashed) over strain."""
    colour = COLOURS[len(axes.lines) // 2 % len(COLOURS)]
    name = label or (f"rate {run.shear_rate:g}/$\\tau_1$" if run.shear_rate else "quasi-static")
    parts = ((run.stress, name, "-", 1.6), (run.elastic_stress, "elastic part", "--", 1.2))
    for stress, text, line, width in parts:
        look = {"color": colour, "linestyle": line, "linewidth": width, "label": text}
        axes.plot(run.strain, stress, **merged(Line2D, look, style))
    label_axes(axes, r"strain $\gamma$", in_unit(r"shear stress $\sigma$", run.unit))
    axes.legend(fontsize=LEGEND)
    say_balance(axes, run.imbalance)


def draw_flow_curve(axes: Axes, curve: FlowCurve, /, label: str = "", **style: Any) -> None:
    """Draw stress over rate with errors, on logarithmic axes; open symbols are not steady."""
    colour = COLOURS[len(axes.containers) % len(COLOURS)]
    look = merged(Line2D, {"color": colour, "marker": "o", "markersize": 5, "linewidth": 1.2}, style)
    stress, left_out = positive(curve.stress)
    name = (label or str(curve.damping)) + left_out
    axes.errorbar(curve.rates, stress, curve.stress_error, capsize=2.5, label=name, **look)
    drifting = ~curve.steady
    if drifting.any():
        open_symbols: dict[str, Any] = {"linestyle": "none", "markerfacecolor": "white", "zorder": 5}
        axes.plot(curve.rates[drifting], stress[drifting], **look | open_symbols | {"label": "not steady"})
    axes.set_xscale("log")
    axes.set_yscale("log")
    label_axes(axes, r"rate of shear $\dot\gamma\,\tau_1$", in_unit(r"shear stress $\sigma$", curve.unit))
    axes.legend(fontsize=LEGEND)
    say_balance(axes, curve.imbalance.max(initial=0.0))


def draw_lissajous(axes: Axes, found: Oscillation, against: str, /, label: str = "", **style: Any) -> None:
    """Draw stress over strain or its rate in the last cycle, the mean stress taken off."""
    rows = found.last_cycle
    x = found.strain[rows] if against == "strain" else found.rate[rows]
    stress = found.stress[rows]
    name = label or rf"$\gamma_0$ = {found.amplitude:g}, $\omega\,\tau_1$ = {found.omega:g}"
    look = {"color": COLOURS[len(axes.lines) % len(COLOURS)], "linewidth": 1.6, "label": name}
    axes.plot(x, stress - stress[1:].mean(), **merged(Line2D, look, style))
    across = r"strain $\gamma$" if against == "strain" else r"rate of strain $\dot\gamma\,\tau_1$"
    axes.locator_params(axis="x", nbins=5)
    label_axes(axes, across, in_unit(r"shear stress $\sigma$, less its mean", found.unit))
    axes.legend(fontsize=LEGEND)
    say_balance(axes, found.imbalance)


def draw_pipkin(axes: Axes, found: Pipkin, /, **style: Any) -> None:
    """Draw the loops of all oscillations, each of one size, at its place on logarithmic axes."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    width, height = (_spacing(np.log10(values)) for values in (found.omega, found.amplitude))
    shares = [each.third_over_first for each in found.oscillations]
    colours = ScalarMappable(Normalize(0.0, max(*shares, 1e-2)), "viridis")
    for each, share in zip(found.oscillations, shares, strict=True):
        rows = each.last_cycle
        stress = each.stress[rows] - each.stress[rows][1:].mean()
        x = each.omega * 10 ** (0.4 * width * each.strain[rows] / each.amplitude)
        y = each.amplitude * 10 ** (0.4 * height * stress / np.abs(stress).max())
        axes.plot(x, y, **merged(Line2D, {"color": colours.to_rgba(np.array(share)), "linewidth": 1.4}, style))
    label_axes(axes, r"angular frequency $\omega\,\tau_1$", r"amplitude $\gamma_0$")
    scale = axes.figure.colorbar(colours, ax=axes)
    scale.set_label(r"third harmonic over first, $|G^*_3|/|G^*_1|$", fontsize=LABEL)
    say_balance(axes, found.imbalance)


def _spacing(places: Any) -> float:
    """Smallest distance of two different places; 1 if there is one only."""
    steps = np.diff(np.unique(places))
    return float(steps.min()) if len(steps) else 1.0


def draw_creep(axes: Axes, run: CreepRun, /, label: str = "", **style: Any) -> None:
    """Draw the compliance over time, on logarithmic axes."""
    values, left_out = positive(run.compliance[1:])
    name = label or rf"$\sigma$ = {run.applied:g}: {_ends(run.reached)}"
    _draw_in_time(axes, run.time[1:], values, name + left_out, **style)
    per_unit = f"1/({run.unit})" if "/" in run.unit or " " in run.unit else f"1/{run.unit}"
    label_axes(axes, r"time $t/\tau_1$", in_unit(r"compliance $J(t)$", per_unit if run.unit else ""))
    axes.legend(fontsize=LEGEND)
    say_balance(axes, run.imbalance)


def draw_relaxation(axes: Axes, run: StressRelaxation, /, label: str = "", **style: Any) -> None:
    """Draw the relaxation modulus over time, on logarithmic axes."""
    values, left_out = positive(run.modulus)
    name = label or rf"$\gamma$ = {run.step_strain:g}: {_ends(run.reached)}"
    _draw_in_time(axes, run.time, values, name + left_out, **style)
    label_axes(axes, r"time $t/\tau_1$", in_unit(r"relaxation modulus $G(t)$", run.unit))
    axes.legend(fontsize=LEGEND)
    say_balance(axes, run.imbalance)


def _draw_in_time(axes: Axes, time: Any, values: Any, label: str, **style: Any) -> None:
    look = {"color": COLOURS[len(axes.lines) % len(COLOURS)], "linewidth": 1.6, "label": label}
    axes.loglog(time, values, **merged(Line2D, look, style))


def _ends(reached: str) -> str:
    return reached.partition(":")[0] if reached.startswith(("STILL", "NOT")) else reached
