"""Vibrations and answers at a frequency of a packing, in a form that views can be compared by."""

import numpy as np
from structure_of_views import NUMBER, SET, STRESS

import jamlab

OMEGA = np.logspace(-4, 3, 8)


def spectrum(view):
    found = jamlab.complex_modulus(view.packing, OMEGA)
    fluid = jamlab.complex_modulus(view.packing, OMEGA, jamlab.StokesDrag())
    heavy = jamlab.complex_modulus(view.packing, OMEGA, masses=view.k)
    losses = {"loss": found.loss, "loss in a fluid": fluid.loss, "loss with masses": heavy.loss}
    storage = {"storage": found.storage, "g0": found.g0, "storage with masses": heavy.storage}
    return {name: (value, STRESS) for name, value in (losses | storage).items()}


def matrices(view):
    """By the lengths of their rows, in no order."""
    n = 2 * len(view.packing.positions)
    found = jamlab.dynamical_matrices(view.packing, masses=view.k)
    parts = dict(zip(("stiffness", "drag", "mass"), found, strict=True))
    return {name: (norms(m.toarray()[:n, :n]), (STRESS, SET)) for name, m in parts.items()}


def norms(matrix):
    return np.hypot.reduce(matrix, axis=1)


def modes(view):
    """The lowest that are not translations or motions of rattlers."""
    found = jamlab.lowest_modes(view.packing, view.packing.n).eigenvalues
    return {"value": (found[found > 1e-6 * found.max()][:3], STRESS)}


def damped(view):
    """Those that oscillate in a fluid; masses in the unit of stiffness."""
    found = jamlab.damped_vibrations(view.packing, jamlab.StokesDrag(), masses=3 * view.k)
    own = {name: np.sort(getattr(found, name)[found.oscillating]) for name in ("frequencies", "attenuation")}
    return {name: (value, NUMBER) for name, value in own.items()} | {"free": (found.free, NUMBER)}


def localised(view):
    """The mode that the softest wave ends in."""
    found = jamlab.quasilocalized_modes(view.packing, 1, masses=view.k)
    numbers = {name: (getattr(found, name)[0], NUMBER) for name in ("frequencies", "participation")}
    return numbers | {"cost": (np.sqrt(found.cost[0]), STRESS)}
