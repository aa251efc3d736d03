"""How contacts and disks move under shear: approach and sliding at contacts, and non-affine displacements.

Near onset the sliding of disks at contacts and their non-affine motion diverge as p^(-1/4) while approach vanishes as
p^(1/4), Baumgarten & Tighe eqs 19-21 and fig 5; that is why the damping of sliding decides the viscosity, eq 22.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from jamlab.arrays import Array
from jamlab.checks import checked
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.mechanics.elasticity import linear_response
from jamlab.mechanics.force_network import force_network
from jamlab.packing.packing import Packing
from jamlab.packing.result import Result
from jamlab.packing.strain_map import SIMPLE_SHEAR
from jamlab.plotting.drawable import LEGEND, drawn, in_unit, label_axes, merged_line
from jamlab.plotting.palette import BLUE, GREEN, RED

NONAFFINE_DEFINITION = 2  # 1 left open how disks move along floppy modes


@dataclass(frozen=True)
class NonaffineResponse(Result):
    """Relative and non-affine displacements per unit of strain gamma of x -> x + gamma y, in the unit of length.

    Attributes:
        normal: (m,) relative displacement along the line of centres of every contact of the backbone, the affine part
            included; positive where disks separate.
        tangential: (m,) the same perpendicular to that line, counter-clockwise.
        nonaffine_tangential: (m,) likewise, of the non-affine displacements alone.
        nonaffine: (n', 2) displacement of every disk of the backbone less the affine one and less the mean.
        unit: unit of length, for labels.

    Example:
        >>> s = jamlab.nonaffine_response(jamlab.pack(n=32, pressure=1e-2, seed=1))
        >>> bool(np.isclose(s.median_normal, np.median(np.abs(s.normal))))
        True
    """

    _rows = ("normal", "tangential", "nonaffine_tangential")
    _apart = ("nonaffine",)

    normal: Array
    tangential: Array
    nonaffine_tangential: Array
    nonaffine: Array
    unit: str = field(default="", repr=False)

    @property
    def median_normal(self) -> float:
        """Median of |normal|, ~ p^(1/4)."""
        return float(np.median(np.abs(self.normal)))

    @property
    def median_tangential(self) -> float:
        """Median of |tangential|, ~ p^(-1/4)."""
        return float(np.median(np.abs(self.tangential)))

    @property
    def median_nonaffine(self) -> float:
        """Median length of the non-affine displacement, ~ p^(-1/4)."""
        return float(np.median(np.hypot(*self.nonaffine.T)))

    @drawn("Line2D, of all three curves")
    def plot(self, axes: Any, /, **style: Any) -> None:
        """Draw the distributions of |normal|, |tangential| and non-affine displacement, medians in the legend.

        >>> ax = jamlab.nonaffine_response(jamlab.pack(n=64, pressure=1e-3, seed=1)).plot()
        """
        parts = (
            ("normal", np.abs(self.normal), "-", BLUE),
            ("tangential", np.abs(self.tangential), "--", RED),
            ("non-affine", np.hypot(*self.nonaffine.T), "-.", GREEN),
        )
        for name, values, line, colour in parts:
            lengths = values[values > 0]
            zero = len(values) - len(lengths)
            label = f"{name}, median {np.median(values):.3g}" + (f", {zero} that do not move left out" if zero else "")
            if len(lengths):
                axes.ecdf(lengths, **merged_line({"color": colour, "linestyle": line, "label": label}, style))
        axes.set_xscale("log")
        label_axes(axes, in_unit(r"displacement per strain", self.unit), "share that is smaller")
        axes.legend(fontsize=LEGEND)


@checked
def nonaffine_response(packing: Packing, *, prestress: bool = True) -> NonaffineResponse:
    """Compute the quasi-static response of each contact to shear: normal, tangential and non-affine displacements.

    Between walls the shear moves the upper wall as a whole, so the displacement of wall particles is not affine.
    Networks of sticky disks and slabs between flat walls have floppy modes: the displacement along them is 0, which is
    the smallest response that balances forces.

    Args:
        packing: SP at an energy minimum.
        prestress: False replaces contacts by unstressed springs, as in fig 5 of Baumgarten & Tighe.

    Raises:
        InputError: a packing of droplets.
        ConvergenceError: see `jamlab.mechanics.elasticity.elastic_tensor`.

    Example:
        >>> p = jamlab.pack(n=32, pressure=1e-2, seed=1)
        >>> s = jamlab.nonaffine_response(p)
        >>> len(s.normal) == jamlab.contacts(p).n_contacts, bool(s.median_tangential > s.median_normal)
        (True, True)
    """
    network = force_network(packing)
    touching = touching_disks(network.packing)  # refuses droplets
    u = linear_response(packing, prestress=prestress).displacements[network.held, :, 0, 1]
    u = u + network.packing.frame.wall_offsets @ SIMPLE_SHEAR.T  # walls are not affine
    i, j, r = touching.i, touching.j, touching.r
    relative = u[j] - u[i]
    normal = r / np.hypot(*r.T)[:, None]
    sliding = relative[:, 1] * normal[:, 0] - relative[:, 0] * normal[:, 1]
    relative[:, 0] += r[:, 1]
    return NonaffineResponse(
        normal=np.einsum("ij,ij->i", relative, normal),
        tangential=relative[:, 1] * normal[:, 0] - relative[:, 0] * normal[:, 1],
        nonaffine_tangential=sliding,
        nonaffine=u - packing.frame.drift(u),
        unit=packing.unit_names.length,
    )
