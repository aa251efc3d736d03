"""Chart of the vertices and contact forms of droplets."""

import time
from collections.abc import Iterator
from functools import partial

from jamlab.engine.deck_defaults import defaults
from jamlab.errors import ConvergenceError, JamlabError
from jamlab.estimates.ways import EnsembleWay, bring_on, default_vertices, free_shape
from jamlab.measure import measure as measure_packing
from jamlab.packing.packing import Packing
from jamlab.protocols.droplets_from_disks import to_polygons
from jamlab.protocols.onset import jam
from studies.speed_accuracy.chart import Chart, Trial, points_of

_DROPLETS, _RHO = 8, 0.88
_COUNTS = (6, 8, 10, 12, 16, 20, 24)  # of a small droplet
_FINEST = (24, 32, 48)  # of the reference: with more some packings do not converge
_FORM, _SMOOTH = "outline", "segment/smooth"
_KINKED = "segment"  # of the paper: it has no minima to end in, and takes seconds to say so
_MEASURED = {"pressure": "pressure, relative", "shape": "shape factor", "g": "G, relative", "z": "z"}
_RELATIVE = ("pressure", "g")

Values = dict[str, float]


def hand_over(seed: int) -> Iterator[Trial]:
    """Hand the same disks over with every number of vertices, and in the kinked form with the default one."""
    small, large = default_vertices()
    ratio = large / small
    try:
        disks = bring_on(EnsembleWay("disks", _DROPLETS), jam("sp", _DROPLETS, seed), _RHO)
        coarse, fine, finest = (_values(disks, _FORM, count, ratio)[0] for count in _FINEST)
    except JamlabError:
        return  # the packing jams beyond rho, or a droplet is pressed through another
    exact, check = _limit(fine, finest, _FINEST[1:]), _limit(coarse, fine, _FINEST[:2])
    for form, count in [(form, count) for form in (_FORM, _SMOOTH) for count in _COUNTS] + [(_KINKED, small)]:
        values: Values = {}
        seconds, note = float("nan"), ""
        try:
            values, seconds, note = _values(disks, form, count, ratio)
        except JamlabError as error:
            note = str(error).splitlines()[0]
        for key, panel in _MEASURED.items():
            scale = abs(exact[key]) if key in _RELATIVE else 1.0
            off = (values.get(key, float("nan")) - exact[key]) / scale
            unsure = abs(exact[key] - check[key]) / scale
            default = form == defaults("dp")["contact"] and count == small
            yield Trial(panel, form, f"{count}/{round(ratio * count)}", seconds, off, unsure, default, note)


def _limit(coarse: Values, fine: Values, counts: tuple[int, ...]) -> Values:
    """Values of smooth outlines: errors of polygons go with 1/count^2 (Richardson). z is a count, and stays."""
    part = 1.0 / ((counts[1] / counts[0]) ** 2 - 1.0)
    return {key: fine[key] + (part * (fine[key] - coarse[key]) if key != "z" else 0.0) for key in fine}


def _values(disks: Packing, form: str, count: int, ratio: float) -> tuple[Values, float, str]:
    """Quantities, CPU seconds from the disks on, and a note. A state of the kinked form counts where its search ends,
    without G, which `measure` refuses there."""
    began = time.process_time()
    way = EnsembleWay("carried", _DROPLETS, (count, round(ratio * count)), form)
    droplets = to_polygons(disks, **way.law)
    note = "" if droplets.converged else f"ends at a largest force of {droplets.max_force:.0e}: no minimum, no G"
    if note and form != _KINKED:
        raise ConvergenceError(note)
    row = measure_packing(droplets)
    seconds = time.process_time() - began
    free = free_shape(way.nv)  # a polygon is no circle even at rest
    return {key: row[key] - (free if key == "shape" else 0.0) for key in _MEASURED}, seconds, note


# some packings jam beyond rho
CHARTS = (Chart("droplet-vertices", hand_over, range(1, 25), partial(points_of, better=1.0)),)
