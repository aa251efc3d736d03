"""Maps where droplets fail: line tension and stiffness, wide rims, few vertices, packing fraction, broken shapes."""

from typing import Any

import numpy as np

from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.packing.packing import Packing
from jamlab.protocols.droplets_from_disks import to_polygons
from jamlab.protocols.random_start import droplet_params
from jamlab.protocols.relaxation import force_tolerance, relax
from studies.stability.map import Axis, Map, Trial, balanced, linear_axis, log_axis, worst_of
from studies.stability.packings import swept
from studies.stability.plain_physics import plain_packing_fraction

_GAMMA, _KA, _DELTA = (float(defaults("dp")[name]) for name in ("gamma", "ka", "delta"))
_COVERED = 2e-4  # error of rho that the plain union of outlines leaves room for


def try_hand_over(disks: Packing, **parameters: Any) -> Trial:
    """Droplets with other parameters in the place of jammed disks: forces, and what they cover."""
    packing = to_polygons(disks, **parameters)
    if not packing.converged:
        return Trial("stalled", f"max force {packing.max_force:.1g}")
    handed = packing.provenance["handover"]
    verdict = "converged" if handed["continuous"] else "another basin"
    scale = max(1.0, float(packing.params["ka"]) + float(packing.params["gamma"]))
    return worst_of(
        balanced(verdict, packing, force_tolerance("dp"), stiffness=scale),
        Trial(verdict, "rho", abs(plain_packing_fraction(packing) - handed["rho"]), _COVERED),
    )


def collapse(ka: float) -> float:
    """Line tension at which a free small droplet shrinks to a point, gamma = 2 ka (a0/3)^(3/2)/sqrt(c)."""
    nv, params = droplet_params(2)
    c = nv[0] * np.tan(np.pi / nv[0])
    return float(2 * ka * (params["a0"][0] / 3) ** 1.5 / np.sqrt(c))


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


def shapes() -> dict[str, np.ndarray]:
    """Broken and awkward outlines, most of them of 12 vertices."""
    collapsed, close, crossing, folded = (ring(12) for _ in range(4))
    collapsed[1] = collapsed[0]
    close[1] = close[0] + 1e-9
    crossing[[2, 5]] = crossing[[5, 2]]
    folded[3] = 2 * folded[4] - folded[3]
    return {
        "regular": ring(12),
        "triangle": ring(3),
        "edge of no length": collapsed,
        "edge of 1e-9": close,
        "concave corners": ring(12, dents=0.35),
        "spikes": ring(12, dents=0.8),
        "needle": ring(12) * [1.0, 0.02],
        "tiny": 0.05 * ring(12),
        "huge": 3.0 * ring(12),
        "one vertex turned over": folded,
        "crosses itself": crossing,
        "clockwise": ring(12)[::-1].copy(),
    }


def try_shape(contact: str, name: str, gap: float) -> Trial:
    """`relax` on one outline beside a regular one, a gap apart in units of the width of rims."""
    packing = place_pair(shapes()[name], ring(12), gap * _DELTA, contact=contact)
    with Session(packing) as session:
        found = relax(session)
        if not found.converged:
            return Trial("stalled", f"max force {found.evaluation.max_force:.1g}")
        return balanced("converged", session.packing(), force_tolerance("dp"), stiffness=_KA)


def edge_at_rest(vertices: int) -> float:
    """Edge of a regular polygon of the rest area of the smaller droplet."""
    _, params = droplet_params(2, nv_small=vertices, nv_large=large_count(vertices))
    return float(np.sqrt(4 * np.tan(np.pi / vertices) / vertices * params["a0"][0]))


def large_count(vertices: int) -> int:
    """Vertices of a large droplet beside a small one, as 17 beside 12."""
    return round(vertices * 17 / 12)


_FORMS = ("outline", "segment/smooth", "segment")  # seeds take one after the other
_RHO = (0.80, 0.83, 0.84, 0.85, 0.86, 0.87, 0.88, 0.9, 0.92, 0.94, 0.96, 0.98, 0.99)

MAPS = (
    Map(
        *("droplet-elasticity", log_axis(1e-3, 300.0, _GAMMA), log_axis(1.0, 3e4, _KA), 2),
        lambda gamma, ka, seed: try_hand_over(swept(4, 0.88, seed), gamma=gamma, ka=ka),
        lambda ka, seed: collapse(ka),
    ),
    Map(
        *("droplet-rims", log_axis(0.01, 1.5, _DELTA), Axis((3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 18), 12), 1),
        lambda delta, nv, seed: try_hand_over(swept(4, 0.88, seed), delta=delta, nv_small=nv, nv_large=large_count(nv)),
        lambda nv, seed: edge_at_rest(nv),
    ),
    Map(
        *("droplet-density", Axis(_RHO, logarithmic=False), log_axis(0.02, 20.0, _GAMMA), 2),
        lambda rho, gamma, seed: try_hand_over(swept(4, rho, seed), gamma=gamma),
    ),
    Map(
        *("droplet-shapes", linear_axis(-1.2, 1.2, count=13), Axis(tuple(shapes())), 3),
        lambda gap, name, seed: try_shape(_FORMS[(seed - 1) % 3], name, gap),
    ),
)
