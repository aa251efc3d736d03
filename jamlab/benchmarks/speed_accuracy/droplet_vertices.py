"""Contact forms and numbers of vertices of droplets, on packings that all come from the same disks."""

import time
from collections.abc import Iterator
from functools import partial

import numpy as np

from jamlab.benchmarks.speed_accuracy.curve_points import points_of
from jamlab.benchmarks.speed_accuracy.topic import Topic, Trial
from jamlab.errors import JamlabError
from jamlab.measure import measure as measure_packing
from jamlab.packing.packing import Packing
from jamlab.protocols.model_choice import Way
from jamlab.protocols.onset import jam
from jamlab.protocols.scene import bring_to, default_way

_N, _RHO = 8, 0.88
_COUNTS = (6, 8, 10, 12, 16, 20, 24)  # of a small droplet
_FINEST = (32, 48)  # of the check and of the reference: with more some packings do not converge
_FORM, _OTHERS = "outline", ("segment/smooth",)  # the form segment of the paper has no minima to end in
_QUANTITIES = {"pressure": "pressure, relative", "shape": "shape factor", "g": "G, relative", "z": "z"}
_RELATIVE = ("pressure", "g")


def measure(seed: int) -> Iterator[Trial]:
    """Hand the same disks over with every number of vertices, and with every form at the default number."""
    onset = jam("sp", _N, seed)
    usual = default_way()
    assert usual.nv is not None
    ratio = usual.nv[1] / usual.nv[0]
    try:
        coarser, exact = (_values(onset, _FORM, count, ratio)[0] for count in _FINEST)
    except JamlabError:
        return  # the packing jams beyond rho, or a droplet is pressed through another
    shrink = (_FINEST[1] / _FINEST[0]) ** 2 - 1  # errors of polygons go with 1/count^2
    ways = [(_FORM, count) for count in _COUNTS] + [(form, usual.nv[0]) for form in _OTHERS]
    for form, count in ways:
        values: dict[str, float] = {}
        seconds, note = float("nan"), ""
        try:
            values, seconds = _values(onset, form, count, ratio)
        except JamlabError as error:
            note = str(error).splitlines()[0]
        for key, panel in _QUANTITIES.items():
            scale = abs(exact[key]) if key in _RELATIVE else 1.0
            off = (values.get(key, float("nan")) - exact[key]) / scale
            unsure = abs(exact[key] - coarser[key]) / scale / shrink
            default = form == usual.contact and count == usual.nv[0]
            yield Trial(panel, form, f"{count}/{round(ratio * count)}", seconds, off, unsure, default, note)


def _values(onset: Packing, form: str, count: int, ratio: float) -> tuple[dict[str, float], float]:
    began = time.process_time()
    row = measure_packing(bring_to(Way("dp", form, (count, round(ratio * count))), onset, _RHO))
    seconds = time.process_time() - began
    nv = np.array([count, round(ratio * count)])
    free = float((nv * np.tan(np.pi / nv) / np.pi).mean())  # of regular polygons: a polygon is no circle even at rest
    return {key: row[key] - (free if key == "shape" else 0.0) for key in _QUANTITIES}, seconds


TOPIC = Topic(
    f"Contact forms and vertices of {_N} droplets at ρ = {_RHO}",
    "error",
    "vertices of a small and of a large droplet",
    "48 and 68 vertices, default contact form, from the same disks. It is not a hundred times better than 24: its own "
    "error, from 32 vertices and the power -2 of their number, is the floor",
    measure,
    seeds=range(1, 25),  # some packings jam beyond rho
    points=partial(points_of, better=1.0),
    reason="12 and 17 vertices are those of Boromand et al., by which their tables are met",
)
