"""Every public function that takes a packing, called in other units: what must stay the same, and how nearly.

`deviation` calls a function with a packing whose lengths are multiplied by s and whose stiffness by k, takes the
units out of its numbers again and compares them with those of the packing as it was. Run as a program, it prints the
largest deviations: `PYTHONPATH=tests/support python tests/support/unit_cases.py`.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import jamlab
from jamlab.measure import QUANTITIES

EXACT, MINIMUM = 1e-9, 1e-6
FLOW = 1e-2  # tolerance of flow in time
STATES = Path(__file__).parents[1] / "states"

NUMBER, LENGTH, AREA, ENERGY, FORCE, STRESS = (0, 0), (0, 1), (0, 2), (1, 0), (1, -1), (1, -2)  # of energy and length
COLUMNS = {"pressure": STRESS, "energy": ENERGY, "contact_energy": ENERGY, "max_force": FORCE, "void_area": AREA} | {
    **dict.fromkeys(("g", "g_x", "b"), STRESS),
    **dict.fromkeys(("contact_length", "shortest_edge", "longest_edge"), LENGTH),
}


@cache
def packings():
    """Packings at a minimum, small enough for every function: disks, dense disks, droplets, droplets in a square box.

    Droplets put in the place of the disks at 1e-2 end in one of several minima, by the last digit of where they start.
    """
    files = {"dp": "stable_droplets.h5", "square": "droplets_at_onset.h5"}
    disks = {"sp": jamlab.pack(n=16, pressure=1e-2, seed=1), "dense": jamlab.pack(n=12, pressure=3e-2, seed=1)}
    return disks | {name: jamlab.read(STATES / file) for name, file in files.items()}


def scaled(packing, s, k):
    """The same packing with lengths times s and stresses times k."""
    powers = {"eps": ENERGY, "k": STRESS, "gamma": (1, -1), "ka": (1, -4), "delta": LENGTH, "eta": LENGTH, "a0": AREA}
    params = {name: value * _unit(powers.get(name, NUMBER), s, k) for name, value in _numbers(packing.params)}
    changes = {} if packing.diameters is None else {"diameters": s * packing.diameters}
    words = {name: value for name, value in packing.params.items() if isinstance(value, str)}
    return packing.with_state(positions=s * packing.positions, box=s * packing.box, params=params | words, **changes)


def _numbers(params):
    return [(name, value) for name, value in params.items() if not isinstance(value, str)]


def _unit(powers, s, k):
    energy, length = powers
    return (k * s**2) ** energy * s**length


@dataclass(frozen=True)
class Case:
    """How a function is called, and what it must give.

    Attributes:
        call: (packing, s, k) -> name -> (numbers, powers of energy and length).
        tolerance: largest deviation allowed.
        models: that the function takes.
    """

    call: Callable
    tolerance: float = EXACT
    models: tuple[str, ...] = ("sp", "dp")


def _fields(function, **powers):
    """Fields of what a function of (packing, s, k) gives, and their powers."""

    def call(*given):
        found = function(*given)
        return {name: (getattr(found, name), unit) for name, unit in powers.items()}

    return call


def _one(function, powers=NUMBER):
    return lambda packing, s, k: {"value": (function(packing), powers)}


def _measured(packing, s, k):
    found = jamlab.measure(packing, QUANTITIES)
    return {name: (value, COLUMNS.get(name, NUMBER)) for name, value in found.items() if name != "max_force"}


def _at_minimum(packing):
    """What says whether a minimum is the same: not the positions of rattlers."""
    quantities = ("rho", "z", "pressure", "energy", "g", "b")
    found = jamlab.measure(packing, quantities)
    more = {"converged": (packing.converged, NUMBER), "box": (packing.box, LENGTH)}
    return {name: (value, COLUMNS.get(name, NUMBER)) for name, value in found.items()} | more


def _displaced(packing, s):
    wave = np.sin(np.arange(packing.positions.size)).reshape(-1, 2)
    return packing.with_state(positions=packing.positions + 1e-3 * s * wave)


def _moduli(function, **more):
    def call(packing, s, k):
        methods = ("linear-response", "affine", "finite-strain")
        return {method: (function(packing, method, **more), STRESS) for method in methods}

    return call


def _spectrum(packing, s, k):
    found = jamlab.complex_modulus(packing, np.logspace(-4, 3, 8))
    fluid = jamlab.complex_modulus(packing, np.logspace(-4, 3, 8), jamlab.StokesDrag())
    losses = {"loss": (found.loss, STRESS), "loss in a fluid": (fluid.loss, STRESS)}
    return dict(storage=(found.storage, STRESS), g0=(found.g0, STRESS)) | losses


def _matrices(packing, s, k):
    stiffness, drag = (m.toarray()[: 2 * packing.n, : 2 * packing.n] for m in jamlab.dynamical_matrices(packing))
    return dict(stiffness=(stiffness, STRESS), drag=(drag, STRESS))


def _coded(text):
    """Numbers that differ where texts do."""
    return np.frombuffer(str(text).encode().ljust(80)[:80], dtype=np.uint8).astype(float)


def _compress(packing, s, k):
    *_, last = jamlab.compress(packing, packing.phi + 0.02, 0.01, by="phi")
    return _at_minimum(last)


def _order(packing):
    found = jamlab.orientational_order(packing)
    return np.concatenate([np.abs(found.local), found.neighbors])


def _motion(packing, s, k):
    """Of modes that drag resists; those of high rates cost hardly any and hold the rounding of its matrix."""
    found = jamlab.mode_motion(packing)
    kept = found.rates < 1e3
    names = ("translation", "rotation", "along", "across", "sliding")
    shares = {name: (np.vdot(getattr(found, name)[kept], found.strengths[kept]), STRESS) for name in names}
    return dict(rates=(found.rates[kept], NUMBER), **shares)


def _droplets(packing, s, k):
    """In units of eps and l, whatever those of the disks are."""
    found = _at_minimum(jamlab.to_polygons(packing, nv_small=8, nv_large=11))
    return {name: (value, NUMBER) for name, (value, _) in found.items()}


def _fractions(packing, s, k):
    methods = ("exact", "nominal") if packing.model == "dp" else ("exact", "pairs", "triples", "nominal")
    return {method: (jamlab.packing_fraction(packing, method), NUMBER) for method in methods}


HELD = dict.fromkeys(("particles", "pairs", "contacts", "self_stresses", "free"), NUMBER)
CASES = {
    "area_ratios": Case(_one(jamlab.area_ratios)),
    "bulk_modulus": Case(_moduli(jamlab.bulk_modulus), MINIMUM),
    "choose_flow": Case(_one(lambda p: _coded(jamlab.choose_flow(p, omega=1.0, amplitude=0.01).way)), models=("dp",)),
    "complex_modulus": Case(_spectrum),
    "compress": Case(_compress, MINIMUM),
    "contact_lengths": Case(_one(lambda p: jamlab.contact_lengths(p).length, LENGTH), models=("dp",)),
    "contacts": Case(_fields(lambda p, s, k: jamlab.contacts(p), pairs=NUMBER, r=LENGTH, z=NUMBER)),
    "creep": Case(lambda p, s, k: {"strain": (jamlab.creep(p, 1e-5 * k, 2.0).strain[-1], NUMBER)}, FLOW),
    "displacement_correlation": Case(
        _fields(
            lambda p, s, k: jamlab.displacement_correlation(p, 1e-2),
            delta=LENGTH,
            correlation=NUMBER,
        )
    ),
    "dynamical_matrices": Case(_matrices),
    "edge_lengths": Case(_one(jamlab.edge_lengths, LENGTH), models=("dp",)),
    "elastic_tensor": Case(_fields(lambda p, s, k: jamlab.elastic_tensor(p), affine=STRESS, relaxed=STRESS)),
    "evaluate": Case(
        _fields(lambda p, s, k: jamlab.evaluate(_displaced(p, s)), energy=ENERGY, forces=FORCE, stress=STRESS)
    ),
    "exact_method": Case(_one(lambda p: _coded(jamlab.exact_method(p)))),
    "flow_curve": Case(
        _one(lambda p: jamlab.flow_curve(p, [1.0], strain=1.2, discard=0.1).stress, STRESS), FLOW, models=("sp",)
    ),
    "held_motions": Case(_fields(lambda p, s, k: jamlab.held_motions(p), **HELD)),
    "hessian": Case(_one(lambda p: jamlab.hessian(p).toarray(), STRESS)),
    "local_packing_fraction": Case(_one(jamlab.local_packing_fraction)),
    "lowest_modes": Case(_one(lambda p: jamlab.lowest_modes(p).eigenvalues, STRESS)),
    "measure": Case(_measured),
    "measure_all": Case(_one(lambda p: jamlab.measure_all([p, p], ["pressure"])["pressure"], STRESS)),
    "mode_motion": Case(_motion, models=("dp",)),
    "nonlinear_modulus": Case(
        _fields(lambda p, s, k: jamlab.nonlinear_modulus(p, [1e-2, 1.0], 0.5, 1e-2 * k), storage=STRESS, loss=STRESS)
    ),
    "orientational_order": Case(_one(_order)),
    "oscillate": Case(
        _fields(lambda p, s, k: jamlab.oscillate(p, 1.0, 1e-4, cycles=2), storage=STRESS, loss=STRESS), FLOW
    ),
    "oscillating_displacements": Case(
        _fields(lambda p, s, k: jamlab.oscillating_displacements(p, 1e-2)[1], real=(-1, 3), imag=(-1, 3))
    ),
    "packing_fraction": Case(_fractions),
    "particle_areas": Case(_one(jamlab.particle_areas, AREA)),
    "relax_stress": Case(_one(lambda p: jamlab.relax_stress(p, 1e-4, 1.0).modulus[-1], STRESS), FLOW),
    "relaxed": Case(lambda p, s, k: _at_minimum(jamlab.relaxed(_displaced(p, s))), MINIMUM),
    "shape_factors": Case(_one(jamlab.shape_factors)),
    "shear": Case(
        _fields(lambda p, s, k: jamlab.shear(p, 0.1, strain=0.02, rows=4), stress=STRESS, pressure=STRESS), FLOW
    ),
    "shear_modulus": Case(_moduli(jamlab.shear_modulus, average=True), MINIMUM),
    "slow_shear": Case(
        _fields(lambda p, s, k: jamlab.slow_shear(p), normal=LENGTH, tangential=LENGTH, nonaffine=LENGTH),
        models=("sp",),
    ),
    "synthetic_micrograph": Case(_one(lambda p: jamlab.synthetic_micrograph(p, 64)), models=("square",)),
    "tessellation": Case(_fields(lambda p, s, k: jamlab.tessellation(p), area=AREA, wall_length=LENGTH, sides=NUMBER)),
    "to_polygons": Case(_droplets, MINIMUM, models=("dense",)),
    "voids": Case(_fields(lambda p, s, k: jamlab.voids(p), sides=NUMBER, area=AREA, perimeter=LENGTH)),
    "without_rattlers": Case(_one(lambda p: jamlab.without_rattlers(p).positions, LENGTH)),
    "zero_modes": Case(_one(jamlab.zero_modes)),
}
NOT_COMPARED = {  # functions that take a packing and give no numbers of it
    **dict.fromkeys(("write", "write_data", "write_dump", "write_page"), "files hold what the packing holds"),
    "geometry_figure": "a picture on axes in the units of the packing",
    "universe": "coordinates as they are",
}


def public_functions_of_packings():
    """Names of public functions one of whose arguments is a packing, or several."""
    found = set()
    for name in jamlab.__all__:
        function = getattr(jamlab, name)
        if inspect.isfunction(function):
            hints = (str(p.annotation) for p in inspect.signature(function).parameters.values())
            if any("Packing" in hint.replace("PackingAnalysis", "") for hint in hints):
                found.add(name)
    return found


def deviation(name, model, s, k):
    """Largest relative deviation of a function's numbers in other units, over the largest number of each array."""
    case, packing = CASES[name], packings()[model]
    wanted, found = _reference(name, model), case.call(scaled(packing, s, k), s, k)
    assert wanted.keys() == found.keys()
    worst = 0.0
    for label, (value, powers) in found.items():
        a, b = np.asarray(wanted[label][0], dtype=float), np.asarray(value, dtype=float) / _unit(powers, s, k)
        if a.shape != b.shape or not np.array_equal(np.isnan(a), np.isnan(b)):
            return np.inf
        kept = ~np.isnan(a)
        largest, off = np.abs(a[kept]).max(initial=0.0), np.abs(a - b)[kept].max(initial=0.0)
        worst = max(worst, float(off / largest if largest else off))
    return worst


@cache
def _reference(name, model):
    return CASES[name].call(packings()[model], 1.0, 1.0)


def print_table():
    """Largest deviation of every function at the corners and in the middle of the range."""
    units = [(1e-6, 1.0), (1e6, 1.0), (1.0, 1e-9), (1.0, 1e9), (0.37, 2.9), (1e-6, 1e-9), (1e6, 1e9)]
    print(f"{'function':26}{'limit':>8}  " + " ".join(f"s={s:g},k={k:g}".rjust(14) for s, k in units))
    for name, case in CASES.items():
        for model in case.models:
            row = []
            for s, k in units:
                try:
                    row.append(f"{deviation(name, model, s, k):.1e}")
                except jamlab.JamlabError as error:
                    row.append(type(error).__name__)
            print(f"{name:23}{model} {case.tolerance:8.0e}  " + " ".join(r.rjust(14) for r in row), flush=True)


if __name__ == "__main__":
    print_table()
