"""Chart of the vertices and contact forms of droplets."""

import time
from collections.abc import Iterator
from functools import partial

from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError, JamlabError
from jamlab.estimates.ways import EnsembleWay, bring_on, default_vertices, free_shape, hand_over
from jamlab.measure import measure
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam
from studies.speed_accuracy.chart import Chart, Trial, points_of

_DROPLETS, _RHO = 8, 0.88
_COUNTS = (6, 8, 10, 12, 16, 24)  # of a small droplet
_FINEST = (24, 32, 48)  # of the reference: with more some packings do not converge
_FORMS = ("outline", "segment/smooth")
_MEASURED = {"pressure": "pressure, relative", "shape_factor": "shape factor", "g": "G, relative"}
_RELATIVE = ("pressure", "g")

Values = dict[str, float]


def of_vertices(seed: int) -> Iterator[Trial]:
    """Put droplets with every number of vertices in the place of the same disks."""
    small, large = default_vertices()
    ratio = large / small
    try:
        disks = bring_on(EnsembleWay("disks", _DROPLETS), jam(_DROPLETS, "sp", seed), _RHO)
        coarse, fine, finest = (_values(disks, _FORMS[0], count, ratio)[0] for count in _FINEST)
    except JamlabError:
        return  # the packing jams beyond rho, or a droplet is pressed through another
    exact, check = limit_of_vertices(fine, finest, _FINEST[1:]), limit_of_vertices(coarse, fine, _FINEST[:2])
    for form in _FORMS:
        for count in _COUNTS:
            values: Values = {}
            seconds, note = float("nan"), ""
            try:
                values, seconds = _values(disks, form, count, ratio)
            except JamlabError as error:
                note = str(error).splitlines()[0]
            for key, panel in _MEASURED.items():
                scale = abs(exact[key]) if key in _RELATIVE else 1.0
                off = (values.get(key, float("nan")) - exact[key]) / scale
                unsure = abs(exact[key] - check[key]) / scale
                default = form == defaults("dp")["contact"] and count == small
                yield Trial(panel, form, f"{count}/{round(ratio * count)}", seconds, off, unsure, default, note)


def limit_of_vertices(coarse: Values, fine: Values, counts: tuple[int, ...]) -> Values:
    """Values of smooth outlines: errors of polygons go with 1/count^2 (Richardson)."""
    part = 1.0 / ((counts[1] / counts[0]) ** 2 - 1.0)
    return {key: fine[key] + part * (fine[key] - coarse[key]) for key in fine}


def _values(disks: Packing, form: str, count: int, ratio: float) -> tuple[Values, float]:
    """Quantities, and CPU seconds from the disks on."""
    began = time.process_time()
    way = EnsembleWay("carried", _DROPLETS, (count, round(ratio * count)), form)
    droplets = hand_over(way, disks)
    if not droplets.converged:
        raise ConvergenceError(f"ends at a largest force of {droplets.max_force:.0e}")
    row = measure(droplets)
    seconds = time.process_time() - began
    free = free_shape(way.nv)  # a polygon is no circle even at rest
    return {key: row[key] - (free if key == "shape_factor" else 0.0) for key in _MEASURED}, seconds


CHARTS = (Chart("droplet-vertices", of_vertices, points=partial(points_of, better=1.0)),)
