"""Map where droplets fail: parameters, width of the circulo-lines, broken shapes."""

from functools import partial
from typing import Any

import numpy as np

from jamlab.benchmarks.failure_maps.verdict import Map, Outcome, attempt, try_relaxing
from jamlab.engine.deck_defaults import defaults
from jamlab.packing.law_parameters import CONTACT_FORMS
from jamlab.packing.packing import Packing
from jamlab.protocols.compression import compress
from jamlab.protocols.droplets_from_disks import to_polygons
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import droplet_params


def try_hand_over(disks: Packing, **parameters: Any) -> tuple[str, str]:
    """Judge droplets with other parameters put in the place of jammed disks."""
    packing = to_polygons(disks, **parameters)
    note = f"max force {packing.max_force:.1g}"
    if not packing.converged:
        return "stalled", note
    return ("converged" if packing.provenance["handover"]["continuous"] else "wrong basin"), note


def _compress_disks(quick: bool) -> Packing:
    *_, disks = compress(jam("sp", 6 if quick else 8, 1), 0.9, 0.02)
    return disks


def _vary_elasticity(quick: bool) -> list[Outcome]:
    disks, law = _compress_disks(quick), defaults("dp")
    runs = []
    for gamma in (0.1, 10.0) if quick else (1e-3, 1e-2, 0.1, 1.0, 10.0):
        for ka in (1.0, 50.0) if quick else (0.5, 5.0, 50.0, 500.0, 5000.0):
            g, k = gamma * float(law["gamma"]) / 0.1, ka * float(law["ka"]) / 50.0
            runs.append(attempt(g, k, partial(try_hand_over, disks, gamma=g, ka=k)))
    return runs


def _vary_width(quick: bool) -> list[Outcome]:
    disks = _compress_disks(quick)
    nv, params = droplet_params(2)
    edge = float(np.sqrt(4 * np.tan(np.pi / nv[0]) / nv[0] * params["a0"][0]))
    runs = []
    for contact in CONTACT_FORMS[:1] if quick else CONTACT_FORMS:
        for ratio in (0.5, 4.0) if quick else (0.1, 0.3, 0.6, 1.0, 2.0, 4.0):
            run = partial(try_hand_over, disks, contact=contact, delta=ratio * edge)
            runs.append(attempt(contact, ratio, run))
    return runs


def place_pair(shape: np.ndarray, second: np.ndarray, gap: float, **parameters: Any) -> Packing:
    """Place two polygons beside each other in a wide box, with a gap between their bounding boxes."""
    _, params = droplet_params(2, **parameters)
    params["a0"] = np.array([1.0, 1.0])
    shift = np.array([gap + shape[:, 0].max() - second[:, 0].min(), 0.0])
    positions = np.concatenate([shape, second + shift]) + 3.0
    offsets = np.array([0, len(shape), len(shape) + len(second)])
    return Packing("dp", 8 * np.eye(2), positions, params, offsets=offsets)


def ring(count: int, radius: float = 0.55, dents: float = 0.0) -> np.ndarray:
    """Vertices (count, 2) of a regular polygon; every other one is drawn inwards by the fraction `dents`."""
    turn = 2 * np.pi * np.arange(count) / count
    reach = radius * np.where(np.arange(count) % 2 == 0, 1.0, 1.0 - dents)
    return np.asarray(reach[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]))


def shapes() -> dict[str, tuple[np.ndarray, float]]:
    """Broken and awkward outlines, each with its gap to a regular neighbour; negative gaps overlap."""
    delta = float(defaults("dp")["delta"])
    overlap = 0.7 * delta
    collapsed = ring(12)
    collapsed[1] = collapsed[0]
    crossing = ring(12)
    crossing[[2, 5]] = crossing[[5, 2]]
    return {
        "regular": (ring(12), overlap),
        "edge of no length": (collapsed, overlap),
        "concave corners": (ring(12, dents=0.35), overlap),
        "spikes": (ring(12, dents=0.8), overlap),
        "crosses itself": (crossing, 0.3),
        "clockwise": (ring(12)[::-1].copy(), 0.3),
        "outlines cross": (ring(12), -0.4),
        "rims just touch": (ring(12), delta),
    }


def _vary_shape(quick: bool) -> list[Outcome]:
    runs = []
    forms = CONTACT_FORMS[:1] if quick else CONTACT_FORMS
    for contact in forms:
        for name, (shape, gap) in shapes().items():

            def run(shape: np.ndarray = shape, gap: float = gap, contact: str = contact) -> tuple[str, str]:
                return try_relaxing(place_pair(shape, ring(12), gap, contact=contact))

            runs.append(attempt(contact, name, run))
    return runs


MAPS = {
    "droplet-elasticity": Map(
        "Droplets: line tension against area stiffness, rho = 0.9",
        "gamma, eps/l",
        "ka, eps/l^4",
        _vary_elasticity,
        "Handed over from disks. Where line tension squeezes soft areas to half their size, jamlab refuses.",
    ),
    "droplet-width": Map(
        "Droplets: width of the circulo-lines over the edge at rest, rho = 0.9",
        "contact form",
        "delta / edge",
        _vary_width,
        "Wide rims leave no room for the polygons. Form segment has its minima at kinks: its states do not converge.",
    ),
    "droplet-shapes": Map(
        "Droplets: broken and awkward shapes beside a regular one",
        "contact form",
        "shape",
        _vary_shape,
        "Outlines that cross themselves, each other, or run clockwise are refused; collapsed edges and dents relax.",
    ),
}
