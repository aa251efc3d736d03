"""Observables of the campaigns beside this file: numbers as one of the papers defines them, which jamlab has not."""

from dataclasses import astuple, replace

import numpy as np

from jamlab.arrays import Array
from jamlab.errors import ConvergenceError
from jamlab.geometry.packing_fraction import lens_area, packing_fraction
from jamlab.geometry.power_cells import cut_disks, find_chords, find_free_arcs
from jamlab.geometry.rims import rims
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.measure import measure
from jamlab.mechanics.force_network import force_network
from jamlab.mechanics.maxwell_count import maxwell_count
from jamlab.mechanics.nonaffine_response import nonaffine_response
from jamlab.packing.natural_units import mean_size
from jamlab.packing.neighbors import Pairs
from jamlab.packing.packing import Packing
from jamlab.rheology.critical_scaling import CRITICAL_RANGE
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.displacement_correlation import correlation_along_x, displacement_response
from jamlab.rheology.equation_of_motion import equation_of_motion
from jamlab.rheology.rounding_error import solve_frequency
from jamlab.rheology.slow_and_fast_limits import find_limits
from jamlab.statistics.power_laws import fit_exponent

SLOW = 1e-2  # omega in the critical regime, at which lanes and both parts of the motion are compared


def add_triples(packing: Packing, times: int = 1) -> float:
    """Packing fraction of disks by [B] eq 12: lenses of pairs subtracted, what three disks share added so many times.
    Once is what inclusion and exclusion asks for, exact where no point lies in four disks; else it is too high."""
    assert packing.diameters is not None
    shared = _shared_by_triples(touching_disks(packing), 0.5 * packing.diameters)
    return packing_fraction(packing, "pairs") + times * shared / packing.area


def rho_printed(packing: Packing) -> float:
    """Packing fraction of disks by [B] eq 12 as printed, which counts what three disks share twice; it passes 1 near
    phi = 1.24, where the exact rho is 0.998."""
    return add_triples(packing, 2)


def _shared_by_triples(near: Pairs, radius: Array) -> float:
    """Sum over triples of disks, in all images, of the area that the three share.

    Three disks alone share |A| + |B| + |C| less than their union counts, plus their three lenses; the union comes from
    the power cells of the three, so that disks inside others need no case of their own. A triple is found from its
    disk of lowest index, as often as that disk has images in it.
    """
    i, j = np.concatenate([near.i, near.j]), np.concatenate([near.j, near.i])
    r = np.concatenate([near.r, -near.r])
    order = np.argsort(i, kind="stable")
    i, j, r = i[order], j[order], r[order]
    kept = i <= j
    i, j, r = i[kept], j[kept], r[kept]
    rows = np.arange(len(i))
    later = np.searchsorted(i, i, side="right") - rows - 1
    a = np.repeat(rows, later)
    b = a + 1 + np.arange(len(a)) - np.repeat(np.cumsum(later) - later, later)
    apart = r[b] - r[a]
    meet = np.hypot(*apart.T) < radius[j[a]] + radius[j[b]]
    a, b, apart = a[meet], b[meet], apart[meet]

    times = 1 + (j[a] == i[a]).astype(int) + (j[b] == i[a])
    three = np.column_stack([radius[i[a]], radius[j[a]], radius[j[b]]])
    disk = 3 * np.arange(len(a))[:, None] + np.arange(3)
    first, second = disk[:, [0, 0, 1]].ravel(), disk[:, [1, 2, 2]].ravel()
    sides = np.stack([r[a], r[b], apart], axis=1).reshape(-1, 2)
    triples = Pairs(first, second, sides, np.zeros((len(first), 2), dtype=np.int64))
    chords = find_chords(triples, three.ravel())
    union = cut_disks(chords, find_free_arcs(chords), three.ravel()).area.reshape(-1, 3).sum(axis=1)
    lenses = lens_area(np.hypot(*sides.T), three.ravel()[first], three.ravel()[second])
    shared = np.maximum(union - np.pi * (three**2).sum(axis=1) + lenses.reshape(-1, 3).sum(axis=1), 0.0)
    return float((shared / times).sum())


def shared_fraction(packing: Packing) -> float:
    """Area that particles share over the area of the cell: sum of their areas less the area of their union;
    what two share counts once, what three share twice.

    SP: phi - rho. DP: phi - rho is less, or even negative, since phi is that of free droplets: pressed against others
    they have longer outlines, and so more rim.
    """
    own = packing.phi if packing.model == "sp" else float(rims(packing).area.sum() / packing.area)
    return own - packing_fraction(packing)


def count_motions(packing: Packing) -> dict[str, float]:
    """`maxwell_count` as columns of the table "states"."""
    names = ("load_bearing", "pairs", "site_contacts", "self_stresses", "free_motions")
    return dict(zip(names, map(float, astuple(maxwell_count(packing))), strict=True))


def root_mean_squares(packing: Packing) -> dict[str, float]:
    """Root mean squares of approach and sliding in slow shear without pre-stress, and contacts per area, an observable.
    Without pre-stress G_0 is k times the sum of squared approaches over the area, [T] eq 19."""
    try:
        motion = nonaffine_response(packing, prestress=False)
    except ConvergenceError:  # not stable
        return dict.fromkeys(("rms_normal", "rms_tangential", "contact_density"), np.nan)
    normal, tangential = (float(np.sqrt(np.mean(part**2))) for part in (motion.normal, motion.tangential))
    density = len(motion.normal) / packing.area
    return {"rms_normal": normal, "rms_tangential": tangential, "contact_density": density}


def slopes_without_rotations(packing: Packing) -> dict[str, float]:
    """Critical slopes of G' - G_0 and G'' under balanced contact damping of disks that do not turn, an observable."""
    network = force_network(packing)
    whole = equation_of_motion(network, ContactDamping())
    m = whole.moving
    still = replace(whole, k_qq=whole.k_qq[:m, :m], b_qq=whole.b_qq[:m, :m], k_qg=whole.k_qg[:m], b_qg=whole.b_qg[:m])
    omega = np.geomspace(CRITICAL_RANGE.lowest * measure(packing, "pressure")["pressure"], CRITICAL_RANGE.highest, 9)
    try:
        limits = find_limits(still)
    except ConvergenceError:  # not stable
        return {"storage_slope": np.nan, "loss_slope": np.nan}
    found = np.array([solve_frequency(still, limits.floppy, float(w))[1] for w in omega])
    return {"storage_slope": fit_exponent(omega, found.real - limits.g0), "loss_slope": fit_exponent(omega, found.imag)}


def lengths_otherwise(packing: Packing) -> dict[str, float]:
    """First zero of C at a critical frequency, in lanes of other heights and of the motion at zero stress; an
    observable, by contact damping."""
    try:
        backbone, u = displacement_response(packing, SLOW)
    except ConvergenceError:  # not stable
        return dict.fromkeys(("length", "length_half_lane", "length_quarter_lane", "length_imaginary"), np.nan)
    ways = {
        "": (u.real, 1.0),
        "_half_lane": (u.real, 0.5),
        "_quarter_lane": (u.real, 0.25),
        "_imaginary": (u.imag, 1.0),
    }
    found = {}
    for way, (motion, lane) in ways.items():
        c = correlation_along_x(backbone.positions, motion[:, 1], packing.box, lane=lane, size=mean_size(packing))
        try:
            found[f"length{way}"] = c.length
        except ConvergenceError:
            found[f"length{way}"] = float("nan")
    return found
