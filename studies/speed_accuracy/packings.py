"""Charts of what makes packings: minimisers of droplets, the search for onset, and packing at a pressure."""

import operator
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from jamlab.arguments.choices import Search
from jamlab.engine.deck_defaults import defaults
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError
from jamlab.estimates.ways import bring_on, default_way
from jamlab.packing.box_strains import COMPRESSION, BoxStrains
from jamlab.packing.packing import Packing
from jamlab.protocols.onset import jam
from jamlab.protocols.random_start import random_disks
from jamlab.protocols.relaxation import relax_session, usual_force_tolerance
from jamlab.protocols.target_pressure import pack
from studies.speed_accuracy.chart import Chart, Panel, Trial

# minimisers of droplets
_RHO, _DROPLETS = (0.88, 0.95), 8
_KICK = 0.003  # mean diameters: far more than any force tolerance leaves, less than half a rim
_STYLES = ("fire", "cg", "jamlab relax")  # the first two with the settings of the decks
_DROPLET_STEPS = 20_000  # bound
_DROPLET_TOLERANCES = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
_DROPLET_ROUNDING = 1e-14  # of a sum of forces: distances err by 1e-16, and the stiffness of a rim is 1/delta^2


def minimise_droplets(seed: int) -> Iterator[Trial]:
    """Measure at both packing fractions, from the loosest tolerance until one is not met."""
    onset = jam(_DROPLETS, "sp", seed)
    for rho in _RHO:
        found = bring_on(default_way(_DROPLETS), onset, rho)
        kicks = _KICK * np.random.default_rng(seed).standard_normal(found.positions.shape)
        start = found.with_state(positions=found.positions + kicks)
        panel = Panel(f"ρ = {rho}", 0.0, _DROPLET_ROUNDING, operator.sub, {"runs": 1})
        with Session(start) as session:
            for style in _STYLES:
                trial = Trial(panel.name, style, "", 0.0, 0.0)
                for tolerance in _DROPLET_TOLERANCES:
                    if np.isfinite(trial.error):
                        trial = panel.trial(style, "", partial(_descend_droplets, session, start, style, tolerance))
                    default = style == _STYLES[-1] and tolerance == usual_force_tolerance("dp")
                    yield replace(trial, setting=f"{tolerance:g}", default=default)


def _descend_droplets(session: Session, start: Packing, style: str, tolerance: float) -> float:
    session.load(start, anew=True)
    if style == _STYLES[-1]:
        left = relax_session(session, tolerance).evaluation.max_force
    else:
        left = session.minimize(
            tolerance, minimizer="fire" if style == "fire" else "cg", steps=_DROPLET_STEPS
        ).max_force
    if left > tolerance:
        raise ConvergenceError(f"ends at a largest force of {left:.1g}")
    return left


# the search for onset
_N = 16
_STEPS: dict[Search, tuple[float, ...]] = {
    "bisection": (0.1, 5e-2, 1e-2, 2e-3, 5e-4),
    "incremental": (1e-2, 3e-3, 1e-3, 3e-4),
}


def search_onset(seed: int) -> Iterator[Trial]:
    """Search from one random start by every step."""
    search = partial(_find, seed)
    panel = Panel(
        "onset of one packing",
        search("incremental", float(defaults("onset")["step_paper"])),
        1e-8,
        operator.sub,
        {"runs": 1},
    )
    for way, steps in _STEPS.items():
        for step in steps:
            default = way == "bisection" and step == float(defaults("onset")["search_step"])
            yield panel.trial(way, f"{step:g}", partial(search, way, step), default)


def _find(seed: int, search: Search, step: float) -> float:
    return jam(_N, "sp", seed, search=search, step=step).phi


# packing at a pressure
_DISKS = 256
_PRESSURES = (1e-2, 1e-3, 1e-4)
_FORCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)  # over the pressure
_PACK_FORCES = (1e-4, 1e-6)  # the same where Newton steps follow: they need a start, and end far below
_FIRE_STEPS = 50_000


def pack_to_pressures(seed: int) -> Iterator[Trial]:
    """Measure at every pressure from one random start; the target itself is the reference."""
    for pressure in _PRESSURES:
        panel = Panel(f"p = {pressure:g} k", pressure, 1e-16 / pressure, lambda p, asked: p / asked - 1, {"runs": 1})
        usual = usual_force_tolerance("sp")
        for force in (*(f * pressure for f in _PACK_FORCES), usual):
            yield panel.trial("pack", f"force {force:g}", partial(_pack, pressure, seed, force), force == usual)
        for force in _FORCES:
            yield panel.trial("free box, FIRE alone", f"{force:g} p", partial(_fire_in_free_box, pressure, seed, force))


def _pack(pressure: float, seed: int, force: float) -> float:
    return float(pack(_DISKS, pressure, seed, force_tolerance=force).provenance["pressure"])


def _fire_in_free_box(pressure: float, seed: int, force: float) -> float:
    """The pressure where the enthalpy is minimised by FIRE alone, from the start on."""
    phi = float(defaults("pressure")["phi_jammed"]) + 2 * pressure
    with Session(random_disks(_DISKS, seed, phi=phi, units="k")) as session:
        session.minimize(1e-2 * pressure, minimizer="fire", steps=_FIRE_STEPS)  # the box would diverge at once
        box_strains = BoxStrains(COMPRESSION, pressure)
        found = session.minimize(force * pressure, minimizer="fire", steps=_FIRE_STEPS, box_strains=box_strains)
    if found.max_force > force * pressure:
        raise ConvergenceError("force tolerance not met")
    return found.pressure


CHARTS = (
    Chart("droplet-minimisers", minimise_droplets),
    Chart("onset-search", search_onset),
    Chart("pressure-packing", pack_to_pressures),
)
