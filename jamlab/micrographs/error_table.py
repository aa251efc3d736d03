"""Table of errors of `jamlab.micrograph` against each thing that makes a picture worse, one after the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from jamlab.micrographs.errors_of_rendered import picture_errors, truth
from jamlab.packing.packing import Packing

PIXELS = 450  # width of a picture of 64 droplets: radius 30 pixels
PLAIN: dict[str, Any] = {"light": 1.0, "noise": 0.02, "blur": 0.7, "film": 2.0}  # what does not vary
SWEEPS: dict[str, tuple[float, ...]] = {
    "light": (1.0, 0.6, 0.35, 0.2),
    "noise": (0.0, 0.1, 0.2, 0.4),
    "blur": (0.0, 1.5, 3.0, 5.0),
    "film": (0.0, 1.0, 2.0, 4.0),
    "radius": (6.0, 12.0, 20.0, 45.0),
}


def error_table(packings: Mapping[float, Packing]) -> pd.DataFrame:
    """Errors along each sweep of `SWEEPS`; with 64 droplets a few minutes for each packing.

    Args:
        packings: nominal rho -> droplets at that rho.

    Returns:
        A row per picture: parameter, value (pixels, or of the contrast), state (rho), and the columns of
        `picture_errors`; half of all pictures have a scale bar.
    """
    rows = []
    for state, packing in packings.items():
        known = truth(packing)
        across = float((packing.box[0, 0] * packing.box[1, 1] / packing.n) ** 0.5 * 0.53)  # a radius near rho = 0.9
        for parameter, values in SWEEPS.items():
            for k, value in enumerate(values):
                how, pixels = dict(PLAIN), PIXELS
                if parameter == "radius":
                    pixels = round(value * float(packing.box[0, 0]) / across)
                else:
                    how[parameter] = value
                row = picture_errors(packing, pixels, known, **how, seed=k, scale_bar=bool(k % 2))
                rows.append({"parameter": parameter, "value": value, "state": state} | row)
    return pd.DataFrame(rows)
