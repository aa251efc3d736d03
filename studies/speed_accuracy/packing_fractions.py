"""Chart of the true packing fraction of disks: exact, by pairs, nominal, and by random points."""

import operator
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from jamlab.arguments.choices import FractionMethod
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.geometry.voids.voids import voids
from jamlab.packing.packing import Packing
from jamlab.protocols.random_start import random_disks
from studies.speed_accuracy.chart import Chart, Panel, Trial
from studies.speed_accuracy.moduli import relaxed

_PHI = (0.86, 1.0, 1.2)
_DISKS = 64
_METHODS: tuple[FractionMethod, ...] = ("exact", "pairs", "nominal")
_COUNTS = (100, 1000, 10_000, 100_000)  # random points
_ROUNDING = 1e-15  # of areas of order 1: what the two exact ways, which share no step, differ by at most
_CALLS = 20  # of one timing: a way that only divides two numbers is faster than the clock resolves


def measure_fractions(seed: int) -> Iterator[Trial]:
    """Measure all methods on one packing at three phi, against 1 minus the voids, which needs no overlap areas."""
    for phi in _PHI:
        packing = relaxed(random_disks(_DISKS, seed, phi=phi))
        reference = 1.0 - float(voids(packing).area.sum()) / packing.area
        panel = Panel(f"φ = {phi:g}", reference, _ROUNDING, operator.sub, {"runs": 5, "budget": 0.1})
        for method in _METHODS:
            trial = panel.trial(method, "", partial(_anew, packing, method), method == "exact")
            yield replace(trial, seconds=trial.seconds / _CALLS)
        for count in _COUNTS:
            yield panel.trial("random points", f"{count}", partial(covered, packing, count, seed))


def _anew(packing: Packing, method: FractionMethod) -> float:
    """What a method gives of packings of which nothing is known yet: a packing keeps what was computed of it."""
    for _ in range(_CALLS):
        found = packing_fraction(packing.with_state(positions=packing.positions.copy()), method)
    return found


def covered(packing: Packing, count: int, seed: int) -> float:
    """Share of random points that lie inside a disk, in a box with right angles: error sqrt(rho (1 - rho)/count)."""
    sides = packing.box.diagonal()
    points = np.random.default_rng(seed).uniform(size=(count, 2)) * sides
    inside = np.zeros(count, dtype=bool)
    for centre, diameter in zip(packing.positions, packing.disk_diameters, strict=True):
        apart = points - centre
        apart -= sides * np.round(apart / sides)
        inside |= (apart**2).sum(axis=1) < 0.25 * diameter**2
    return float(inside.mean())


CHARTS = (Chart("packing-fraction", measure_fractions),)
