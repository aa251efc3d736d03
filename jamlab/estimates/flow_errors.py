"""How far simpler models of flow are off: the error that they promise for a packing at some conditions.

`flow_errors.json` in this package, made by `python -m studies tables flow-errors`, holds what runs of disks at many
conditions showed, each beside the simpler model. Two numbers carry them over to other packings: amplitude over overlap,
which says whether contacts change, and drag over elasticity of a contact that moves with the affine flow.
"""

import json
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources
from typing import Any, NamedTuple

import numpy as np

from jamlab.arrays import Array
from jamlab.mechanics.stiffness import pressure
from jamlab.models.disks import DISKS
from jamlab.packing.natural_units import stiffness_scale
from jamlab.packing.packing import Packing
from jamlab.rheology.drag_law import DragLaw


@dataclass(frozen=True)
class Measured:
    """Runs of which the shipped table holds errors."""

    size: int = 64  # disks of the packings that were measured
    laws: tuple[str, ...] = ("contact", "stokes")  # of drag, by name
    stokes: float = 0.0  # in the place of alpha
    # drag against the affine flow in all steady flow that was measured, k tau_1; power laws take ten times longer
    # without
    background: float = 1e-2
    least_error: float = 0.01  # that a promise can be: the runs are as good as that
    # of standard errors: runs over a strain of 60 say 1.1 to 1.8 times those that were measured, over 3
    short_blocks: float = 1.5
    springs: float = 2.0  # exponent of the repulsion of all disks that were measured
    ratio: float = 1.4  # of their two sizes, half and half
    digits: float = 1e-4  # relative: conditions have five digits


CONDITIONS = Measured()


class FlowCondition(NamedTuple):
    """What is asked of the table."""

    # "oscillation": linear spectrum, for alpha below 1 by equivalent damping; "flow": stress of linear drag at the rate
    # to the power alpha
    kind: str
    alpha: float  # of contact drag, or `CONDITIONS.stokes`
    # over the elastic force of a contact that moves with the affine flow, (tau_1 omega)^alpha amplitude^(alpha - 1), by
    # which alone G* depends on frequency and amplitude while contacts stay; of flow, the rate of linear drag
    drag: float
    amplitude: float = 1.0  # strain over `mean_overlap`; 1 of flow
    beta: float = 1.0  # of contact drag

    @classmethod
    def oscillating(cls, packing: Packing, law: DragLaw, omega: float, amplitude: float) -> "FlowCondition":
        """Describe an oscillation of a packing by the two numbers that carry over to others."""
        drag = (law.tau * omega) ** law.alpha * amplitude ** (law.alpha - 1.0)
        part = amplitude / mean_overlap(packing)
        return cls("oscillation", law.alpha if law.at_contacts else CONDITIONS.stokes, float(drag), part, law.contrast)

    @classmethod
    def steady(cls, law: DragLaw, rate: float) -> "FlowCondition":
        """Describe steady flow by the rate at which linear drag gives the same stress."""
        alpha = law.alpha if law.at_contacts else CONDITIONS.stokes
        return cls("flow", alpha, float((law.tau * rate) ** law.alpha), beta=law.contrast)


@dataclass(frozen=True, eq=False)
class FlowErrors:
    """Errors that were measured, on a grid of conditions.

    Attributes:
        content: `grids`, for each kind and drag law the error that is promised (null: nothing) over alpha, drag and
            amplitude; `scatter` of a mean stress; `measured`, ranges of the conditions.
    """

    content: dict[str, Any]

    def promise(self, flow: FlowCondition) -> float:
        """Relative error that the simpler model keeps in 95 % of new packings; infinite where nothing was measured.

        Between conditions it lies on lines; where drag or strain are less than in the grid, and errors tend to a
        limit, it is the error of the least. One packing in twenty rearranges early, which a few do not show: no G* is
        promised better than that under linear drag, of which there are many.
        """
        grid = self._grids.get(f"{flow.kind}, {'stokes' if flow.alpha == CONDITIONS.stokes else 'contact'}")
        if grid is None:
            return np.inf
        alphas, drags, amplitudes, upper = grid
        alpha, x, y = flow.alpha, float(np.log(flow.drag)), float(np.log(flow.amplitude))
        if flow.kind == "flow":
            alpha = min(alpha, alphas[-1])
        else:  # linear drag tends to the limit of slow shear, and all drag to that of small strains
            x = max(x, drags[0]) if alpha in (CONDITIONS.stokes, 1.0) else x
            x, y = min(x, drags[-1]), max(y, amplitudes[0])
        places = ((alpha, alphas), (x, drags), (y, amplitudes))
        if any(not axis[0] - CONDITIONS.digits <= at <= axis[-1] + CONDITIONS.digits for at, axis in places):
            return np.inf
        found = [np.interp(y, amplitudes, [np.interp(x, drags, each) for each in grid.T]) for grid in upper]
        promised = max(float(np.interp(alpha, alphas, np.exp(found))), CONDITIONS.least_error)  # linear in 1 - alpha
        if flow.kind == "flow" or alpha == 1.0:
            return promised
        return max(promised, self.promise(flow._replace(alpha=1.0)))

    @property
    def scatter_of_flow(self) -> float:
        """Standard error of a mean stress over that stress, of 64 disks at unit strain. Stress of 64 disks remembers
        more strain than blocks of a short run are long: what was measured is raised by as much."""
        return CONDITIONS.short_blocks * float(self.content["scatter"])

    def outside(self, packing: Packing, flow: FlowCondition) -> tuple[str, ...]:
        """What of a packing and a flow lies outside the conditions of its kind; larger packings do not."""
        measured, linear = self.content["measured"][flow.kind], flow.alpha in (CONDITIONS.stokes, 1.0)
        found = [] if packing.model == DISKS.name else [f"model = {packing.model}, measured {DISKS.name} alone"]
        if flow.kind == "flow" and flow.alpha == CONDITIONS.stokes:
            found += ["drag = Stokes, measured contact damping alone"]
        force_law = packing.params.get("law", "sticky" if packing.params.get("stickiness") else "power")
        if force_law != "power":
            found += [f"force law = {force_law}, measured springs alone"]
        exponent = float(packing.params.get("exponent", CONDITIONS.springs))
        given: list[tuple[str, float, float, float]] = [("exponent", exponent, CONDITIONS.springs, CONDITIONS.springs)]
        if (d := packing.diameters) is not None:
            given += [("large over small diameter", d.max() / d.min(), CONDITIONS.ratio, CONDITIONS.ratio)]
            width = (CONDITIONS.ratio - 1) / (CONDITIONS.ratio + 1)
            given += [("width of the diameters", d.std() / d.mean(), width, width)]
        given += [("particles", packing.n, measured["n"], np.inf)]
        given += [("pressure over stiffness", mean_overlap(packing), *measured["pressure"])]
        given += [("beta", flow.beta, 1.0, 1.0)]
        if flow.alpha != CONDITIONS.stokes:
            given += [("alpha", flow.alpha, *measured["alpha"])]
        if flow.kind == "flow":
            given += [("linear rate (tau rate)^alpha", flow.drag, *measured["drag"])]
        else:
            given += [("drag over elasticity", flow.drag, 0.0 if linear else measured["power_drag"], np.inf)]
            largest = measured["linear_amplitude" if linear else "power_amplitude"]
            given += [("strain over overlap", flow.amplitude, 0.0, largest)]
        for name, value, low, high in given:
            if not low * (1 - CONDITIONS.digits) <= value <= high * (1 + CONDITIONS.digits):
                found.append(f"{name} = {value:.2g}, measured {low:.2g} to {high:.2g}")
        return tuple(found)

    @cached_property
    def _grids(self) -> dict[str, tuple[Array, ...]]:
        """alpha, ln drag, ln amplitude and the logarithm of the error."""
        found: dict[str, tuple[Array, ...]] = {}
        for name, grid in self.content["grids"].items():
            error = np.array(grid["error"], dtype=np.float64)  # null becomes nan
            axes = np.array(grid["alpha"]), np.log(grid["drag"]), np.log(grid["amplitude"])
            found[name] = (*axes, np.where(np.isnan(error), np.inf, np.log(error)))
        return found


@cache
def shipped_errors() -> FlowErrors:
    """The shipped errors, read once."""
    return FlowErrors(json.loads(resources.files("jamlab.estimates").joinpath("flow_errors.json").read_text("utf-8")))


def mean_overlap(packing: Packing) -> float:
    """Mean overlap of contacts, pressure over stiffness: at a strain like this a good part of the contacts changes."""
    return pressure(packing) / stiffness_scale(packing)
