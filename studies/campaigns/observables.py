"""Observables of the campaigns beside this file: numbers as one of the papers defines them, which jamlab has not."""

from dataclasses import replace

import numpy as np

from jamlab.errors import ConvergenceError
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.measure import measure
from jamlab.mechanics.force_network import force_network
from jamlab.packing.natural_units import mean_size
from jamlab.packing.packing import Packing
from jamlab.rheology.critical_scaling import CRITICAL, HIGHEST
from jamlab.rheology.damping import ContactDamping
from jamlab.rheology.displacement_correlation import correlation_along_x, oscillating_displacements
from jamlab.rheology.equation_of_motion import equation_of_motion
from jamlab.rheology.rounding_error import solve_frequency
from jamlab.rheology.slow_and_fast_limits import find_limits
from jamlab.statistics.power_laws import fit_exponent

SLOW = 1e-2  # omega in the critical regime, at which lanes and both parts of the motion are compared


def rho_printed(packing: Packing) -> float:
    """Packing fraction of disks by [B] eq 12 as printed, which counts what three disks share twice; it passes 1."""
    return packing_fraction(packing, "paper-triples")


def slopes_without_rotations(packing: Packing) -> dict[str, float]:
    """Critical slopes of G' - G_0 and G'' under balanced contact damping of disks that do not turn, an observable."""
    network = force_network(packing)
    whole = equation_of_motion(network, ContactDamping())
    m = whole.moving
    still = replace(whole, k_qq=whole.k_qq[:m, :m], b_qq=whole.b_qq[:m, :m], k_qg=whole.k_qg[:m], b_qg=whole.b_qg[:m])
    omega = np.geomspace(CRITICAL * measure(packing, "pressure")["pressure"], HIGHEST, 9)
    try:
        g_0 = find_limits(still).g0
    except ConvergenceError:  # not stable
        return {"storage_slope": np.nan, "loss_slope": np.nan}
    found = np.array([solve_frequency(still, float(w))[1] for w in omega])
    return {"storage_slope": fit_exponent(omega, found.real - g_0), "loss_slope": fit_exponent(omega, found.imag)}


def lengths_otherwise(packing: Packing) -> dict[str, float]:
    """First zero of C at a critical frequency, in lanes of other heights and of the motion at zero stress; an
    observable, by contact damping."""
    try:
        backbone, u = oscillating_displacements(packing, SLOW)
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
