"""Maps where flow in time fails: steps, rates, drag laws, oscillation beyond the linear range."""

from functools import lru_cache, partial

import numpy as np

from jamlab.arguments.table import argument
from jamlab.engine.deck_defaults import defaults
from jamlab.flow.flow_run import FlowRun
from jamlab.flow.oscillate import oscillate
from jamlab.flow.overdamped_session import SMALL_STRAIN_TOLERANCE
from jamlab.flow.quasistatic_run import QUASISTATIC
from jamlab.flow.shear import TOLERANCE, ShearRun, shear
from jamlab.packing.packing import Packing
from jamlab.protocols.droplets_from_disks import droplets_from_disks
from jamlab.rheology.damping import DRAG_LIMITS, ContactDamping
from studies.stability.map import Map, Trial, worst_of
from studies.stability.moduli import opening_strain
from studies.stability.packings import packed, swept
from studies.stability.plain_physics import plain_complex_modulus, plain_drag, plain_forces, plain_stress

_N, _PRESSURE, _STRAIN = 8, 1e-2, 0.05
_SUMMED = 10.0  # by which the errors of steps may add up, over the tolerance of one
_PARTED = 0.01  # of the largest stress: a larger difference of the last stress means another path
_ENERGY = 1e-8  # of the work: stored energy is a difference of two larger ones
_ROUNDING = 1e-9  # of stresses: positions go through LAMMPS and back
_BEFORE_CHANGE = 0.3  # of the strain that opens a contact: below, answers are linear
_NOT_LINEAR = 0.05  # of G*
FINEST, COARSEST = (limit or 0.0 for limit in argument("tolerance").limits_at())


_packed = partial(packed, _N, _PRESSURE)  # function of a seed


@lru_cache(maxsize=32)
def droplets(seed: int) -> Packing:
    """A few droplets in the place of disks."""
    return droplets_from_disks(swept(4, 0.88, seed))


def try_shear(
    packing: Packing, rate: float, tolerance: float = TOLERANCE, background: float | None = None, alpha: float = 1.0
) -> Trial:
    """Start-up at a constant rate: energy, elastic stress and, of linear drag on disks, viscous stress at the end."""
    run = _start_up(packing, rate, tolerance, background, alpha)
    verdict = "converged" if run.energy_error <= QUASISTATIC.limit else "stalled"
    checks = [energy_trial(run), elastic_trial(run)]
    if packing.model == "sp" and alpha == 1:
        checks.append(viscous_trial(run))
    return _as(verdict, worst_of(*checks), f"energy balanced to {run.energy_error:.1g}")


def try_tolerance(packing: Packing, rate: float, tolerance: float) -> Trial:
    """The same, and whether the finest steps end at another stress, by another order of contacts."""
    trial = try_shear(packing, rate, tolerance)
    if trial.verdict != "converged":
        return trial
    run, finest = (_start_up(packing, rate, t, None, 1.0) for t in (tolerance, FINEST))
    change = abs(run.stress[-1] - finest.stress[-1]) / np.abs(finest.stress).max()
    return _as("another minimum" if change > _PARTED else "converged", trial, f"{change:.1g} from the finest steps")


def _as(verdict: str, trial: Trial, note: str) -> Trial:
    """The check of a run under another verdict."""
    return Trial(verdict, f"{note}; {trial.note}", trial.error, trial.allowed)


def _start_up(packing: Packing, rate: float, tolerance: float, background: float | None, alpha: float) -> ShearRun:
    law = ContactDamping(alpha=alpha)
    return shear(packing, rate, _STRAIN, law, rows=5, tolerance=tolerance, background_drag=background)


def energy_trial(run: ShearRun) -> Trial:
    """Energy stored, computed anew from the positions at both ends, over the work."""
    first, last = run.frames[0], run.packing
    stored = (plain_forces(last)[0] - plain_forces(first)[0]) / first.area
    largest = max(abs(float(run.work[-1])), abs(float(run.dissipated[-1])))
    error = abs(stored - float(run.energy[-1] - run.energy[0])) / largest
    return Trial("converged", f"energy off by {error:.1g}", error, _ENERGY + _end_of_step(run))


def elastic_trial(run: FlowRun) -> Trial:
    """Elastic stress at the end, from the positions there."""
    plain = -plain_stress(run.packing)[0, 1]
    largest = float(np.abs(run.stress).max())
    error = abs(run.elastic_stress[-1] - plain) / largest
    digits = np.spacing(np.abs(run.packing.box).max()) / largest  # of overlaps, near onset; stiffness is about 1
    allowed = _ROUNDING + 10 * digits + _end_of_step(run)
    return Trial("converged", f"elastic stress off by {error:.1g}", float(error), allowed)


def _end_of_step(run: FlowRun) -> float:
    """Relative difference of numbers from the values of the positions: droplets are corrected at the end of a step."""
    return _SUMMED * run.energy_tolerance if run.packing.model == "dp" else 0.0


def viscous_trial(run: ShearRun) -> Trial:
    """Viscous stress at the end, from velocities solved for anew: B u = F - rate b."""
    assert run.damping is not None
    packing, rate = run.packing, float(run.rate[-1])
    drag = plain_drag(packing, run.damping.contrast, run.background_drag)
    force = np.append(plain_forces(packing)[1].ravel(), np.zeros(packing.n)) - rate * drag[:-1, -1]
    motion = np.append(np.linalg.lstsq(drag[:-1, :-1], force, rcond=1e-13)[0], rate)
    error = abs(drag[-1] @ motion / packing.area - run.viscous_stress[-1]) / np.abs(run.stress).max()
    allowed = _SUMMED * run.energy_tolerance + _ROUNDING
    return Trial("converged", f"viscous stress off by {error:.1g}", float(error), allowed)


def try_oscillation(packing: Packing, omega: float, amplitude: float) -> Trial:
    """First harmonic: against the linear answer where no contact can open, else only that it repeats."""
    run = oscillate(packing, omega, amplitude)
    if not run.finished:
        return Trial("stalled", "does not repeat")
    exact = plain_complex_modulus(packing, omega)
    error = abs(complex(run.storage, run.loss) - exact) / abs(exact)
    note, elastic = f"G* off by {error:.1g}", elastic_trial(run)
    if amplitude > _BEFORE_CHANGE * opening_strain(packing):
        return _as("another minimum" if error > _NOT_LINEAR else "converged", elastic, note)
    return worst_of(Trial("converged", note, error, _SUMMED * SMALL_STRAIN_TOLERANCE), elastic)


MAPS = (
    Map(
        "flow-tolerance",
        lambda tolerance, rate, seed: try_tolerance(_packed(seed), rate, tolerance),
        lambda *_: COARSEST,
        (TOLERANCE, None),
    ),
    Map(
        "flow-background",
        lambda background, rate, seed: try_shear(_packed(seed), rate, background=background),
        defaults=(float(defaults("flow.sp")["background_drag"]), None),
    ),
    Map(
        "flow-power",
        lambda alpha, rate, seed: try_shear(_packed(seed), rate, alpha=alpha),
        lambda *_: DRAG_LIMITS.alpha,
        (1.0, None),
    ),
    Map(
        "flow-droplets",
        lambda tolerance, rate, seed: try_shear(droplets(seed), rate, tolerance),
        defaults=(TOLERANCE, None),
    ),
    Map(
        "oscillation-amplitude",
        lambda amplitude, omega, seed: try_oscillation(_packed(seed), omega, amplitude),
        lambda omega, seed: opening_strain(_packed(seed)),
    ),
)
