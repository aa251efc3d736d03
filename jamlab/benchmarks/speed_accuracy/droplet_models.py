"""Compare contact forms and numbers of vertices of droplets, and disks as a model of droplets."""

import time

import numpy as np

from jamlab.benchmarks.model_table import finest_way, make_table
from jamlab.benchmarks.speed_accuracy.trial import Topic, Trial
from jamlab.engine.session import Session
from jamlab.errors import ConvergenceError, JamlabError
from jamlab.geometry.packing_fraction import packing_fraction
from jamlab.mechanics.elasticity import compression_modulus, elastic_tensor
from jamlab.mechanics.stiffness import stress
from jamlab.packing.deformation import at_phi
from jamlab.packing.law_parameters import CONTACT_FORMS
from jamlab.packing.packing import Packing
from jamlab.protocols.model_choice import Way
from jamlab.protocols.onset import jam
from jamlab.protocols.relaxation import relax
from jamlab.protocols.scene import bring_to, default_way, quantities
from jamlab.statistics.published_numbers import MODELS_PART

_RHO = MODELS_PART.value  # from here on disks no longer stand for droplets
_COUNTS = (6, 8, 12, 16, 24, 32, 64)  # vertices of a small droplet; the finest that converges is the reference
_QUICK_COUNTS = (6, 12, 24)
_UNLOADED = 2e-4  # step of relative packing fraction that no longer matters
_LARGEST_STEP = 0.03  # of relative packing fraction, however far the bulk modulus reaches
_DECOMPRESSIONS = 12  # at most
_STRIDE = 0.7  # fraction of the expected distance to zero pressure that a step takes
_PANELS = {"rho_J": "rho_J", "z": "z", "g": "G, relative", "a": "A - A_J"}


def measure_trials(quick: bool) -> list[Trial]:
    """Hand one packing over from disks at rho = 0.88 and, unless quick, decompress it until it unjams."""
    counts = _QUICK_COUNTS if quick else _COUNTS
    onset = jam("sp", 10 if quick else 16, 1)
    usual = default_way()
    assert usual.nv is not None and usual.contact is not None
    ratio = usual.nv[1] / usual.nv[0]
    panels = {k: v for k, v in _PANELS.items() if k != "rho_J" or not quick}
    reference: dict[str, float] | None = None
    found = []
    for contact in (usual.contact, *(form for form in CONTACT_FORMS if form != usual.contact and not quick)):
        for count in reversed(counts) if contact == usual.contact else (usual.nv[0],):
            default = contact == usual.contact and count == usual.nv[0]
            name = f"{count}/{round(ratio * count)}"
            note, seconds = "", float("nan")
            values = dict.fromkeys(panels, float("nan"))
            try:
                values, seconds = _measure_droplets(onset, contact, count, ratio, not quick)
            except JamlabError as error:
                note = str(error)
            if reference is None and not note:
                reference = values
                continue
            for panel, label in panels.items():
                off = abs(values[panel] - reference[panel]) if reference else float("nan")
                off /= abs(reference["g"]) if reference and panel == "g" else 1.0
                found.append(Trial(label, contact, name, seconds, off, default, note))
    return found


def _measure_droplets(
    onset: Packing, contact: str, count: int, ratio: float, unjams: bool
) -> tuple[dict[str, float], float]:
    began = time.process_time()
    packing = bring_to(Way("dp", contact, (count, round(ratio * count))), onset, _RHO)
    values = quantities(packing)
    seconds = time.process_time() - began
    return values | ({"rho_J": find_unjamming(packing)} if unjams else {}), seconds


def find_unjamming(packing: Packing) -> float:
    """Find the true packing fraction, to about 2e-4, at which a packing loses its pressure when decompressed.

    If it unjams in one step, half of the step is tried from the last jammed state; from a state that is almost unloaded
    the bulk modulus extrapolates the rest.

    Raises:
        ConvergenceError: the packing given is not jammed.
    """
    jammed, share = packing, _STRIDE
    with Session(packing) as session:
        for _ in range(_DECOMPRESSIONS):
            pressure = 0.5 * float(np.trace(stress(jammed)))
            modulus = compression_modulus(elastic_tensor(jammed).relaxed, pressure)
            rest = min(pressure / max(modulus, 1e-12), _LARGEST_STEP)
            rho = packing_fraction(jammed)
            if share * rest <= _UNLOADED:
                return rho * (1 - rest) if share > 0.5 else rho
            session.load(at_phi(jammed, jammed.phi * (1 - share * rest)))
            if relax(session).converged and _bears_load(session.packing()):
                jammed, share = session.packing(), _STRIDE
            else:
                share *= 0.5
    return packing_fraction(jammed)


def _bears_load(packing: Packing) -> bool:
    try:
        return compression_modulus(elastic_tensor(packing).relaxed, 0.0) > 0
    except ConvergenceError:
        return False


def measure_disks_as_droplets(quick: bool) -> list[Trial]:
    """Measure every way to model droplets against the finest polygons, at growing rho; means over a few packings."""
    levels = (0.86, 0.9) if quick else (0.86, 0.88, 0.92, 0.96)
    table = make_table(
        None,
        n=10 if quick else 16,
        seeds=range(2001, 2002 if quick else 2004),
        levels=levels,
        forms=(),
        fractions=(1 / 2, 2 / 3),
        reference=finest_way(),
    )
    usual = default_way()
    found = []
    for name, label in (("z", "z"), ("g", "G, relative"), ("a", "A - A_J"), ("void_sides", "sides of voids")):
        for row in table["rows"]:
            way = row["way"]
            nv = way["nv"]
            method = "disks (SP)" if nv is None else f"polygons, {way['contact']}"
            setting = "" if nv is None else f"{nv[0]}/{nv[1]}"
            default = nv is not None and tuple(nv) == usual.nv and way["contact"] == usual.contact
            values = np.abs(row["errors"][name])
            seconds = row["seconds"] if len(values) else float("nan")
            error = float(values.mean()) if len(values) else float("nan")
            note = f"{row['failed']} of {row['of']} failed" if row["failed"] else ""
            found.append(Trial(f"{label}, rho = {row['rho']:g}", method, setting, seconds, error, default, note))
    return found


TOPIC = Topic(
    "Contact form and vertices of droplets",
    "error",
    "as many as converge of 64, 32, .. (quick: 24) vertices on a small droplet, default contact form, same packing",
    measure_trials,
    "The default number of vertices is that of Boromand et al., by which their tables are met; fewer cost less.",
)
MODELS = Topic(
    "Disks as a model of droplets",
    "mean error",
    "polygons with twice the default number of vertices on the same packings; time from the random start on",
    measure_disks_as_droplets,
)
