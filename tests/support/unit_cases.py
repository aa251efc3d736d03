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


def numbers(**found):
    return found


def _measured(packing, s, k):
    found = jamlab.measure(packing, QUANTITIES)
    return {name: (value, COLUMNS.get(name, NUMBER)) for name, value in found.items() if name != "max_force"}


def _at_minimum(packing):
    """What says whether a minimum is the same: not the positions of rattlers."""
    quantities = ("rho", "z", "pressure", "energy", "g", "b")
    found = jamlab.measure(packing, quantities)
    return {name: (value, COLUMNS.get(name, NUMBER)) for name, value in found.items()} | {
        "converged": (packing.converged, NUMBER),
        "box": (packing.box, LENGTH),
    }


def _displaced(packing, s):
    wave = np.sin(np.arange(packing.positions.size)).reshape(-1, 2)
    return packing.with_state(positions=packing.positions + 1e-3 * s * wave)


def _moduli(function, **more):
    def call(packing, s, k):
        methods = ("linear-response", "affine", "finite-strain")
        return {method: (function(packing, method, **more), STRESS) for method in methods}

    return call


def _voids(packing):
    found = jamlab.voids(packing)
    return numbers(sides=(found.sides, NUMBER), area=(found.area, AREA), perimeter=(found.perimeter, LENGTH))


def _spectrum(packing, s, k):
    found = jamlab.complex_modulus(packing, np.logspace(-4, 3, 8))
    fluid = jamlab.complex_modulus(packing, np.logspace(-4, 3, 8), jamlab.StokesDrag())
    losses = {"loss": (found.loss, STRESS), "loss in a fluid": (fluid.loss, STRESS)}
    return numbers(storage=(found.storage, STRESS), g0=(found.g0, STRESS)) | losses


def _matrices(packing, s, k):
    stiffness, drag = (m.toarray()[: 2 * packing.n, : 2 * packing.n] for m in jamlab.dynamical_matrices(packing))
    return numbers(stiffness=(stiffness, STRESS), drag=(drag, STRESS))


def _nonlinear(packing, s, k):
    found = jamlab.nonlinear_modulus(packing, [1e-2, 1.0], 0.5, 1e-2 * k)
    return numbers(storage=(found.storage, STRESS), loss=(found.loss, STRESS))


def _displacements(packing, s, k):
    _, found = jamlab.oscillating_displacements(packing, 1e-2)
    return numbers(real=(found.real, (-1, 3)), imaginary=(found.imag, (-1, 3)))


def _correlation(packing, s, k):
    found = jamlab.displacement_correlation(packing, 1e-2, lane=1.0 * s, width=0.5 * s)
    return numbers(delta=(found.delta, LENGTH), correlation=(found.correlation, NUMBER))


def _shear(rate):
    def call(packing, s, k):
        how = {"strain": 0.02, "rows": 4} if rate else {"strain": 4e-3, "step": 1e-3}
        found = jamlab.shear(packing, rate, **how)
        return numbers(stress=(found.stress, STRESS), pressure=(found.pressure, STRESS))

    return call


def _all_shear(packing, s, k):
    return _shear(0.1)(packing, s, k)


def _flow_curve(packing, s, k):
    found = jamlab.flow_curve(packing, [1.0], strain=1.2, discard=0.1)
    return numbers(stress=(found.stress, STRESS))


def _oscillate(packing, s, k):
    found = jamlab.oscillate(packing, 1.0, 1e-4, cycles=2)
    return numbers(storage=(found.storage, STRESS), loss=(found.loss, STRESS))


def _creep(packing, s, k):
    found = jamlab.creep(packing, 1e-5 * k, 2.0)
    return numbers(strain=(found.strain[-1], NUMBER))


def _relax_stress(packing, s, k):
    found = jamlab.relax_stress(packing, 1e-4, 1.0)
    return numbers(modulus=(found.modulus[-1], STRESS))


def _contacts(packing, s, k):
    found = jamlab.contacts(packing)
    return numbers(pairs=(found.pairs, NUMBER), r=(found.r, LENGTH), z=(found.z, NUMBER))


def _evaluate(packing, s, k):
    e = jamlab.evaluate(_displaced(packing, s))
    return numbers(energy=(e.energy, ENERGY), forces=(e.forces, FORCE), stress=(e.stress, STRESS))


def _flow_choice(packing, s, k):
    return numbers(way=(_coded(jamlab.choose_flow(packing, omega=1.0, amplitude=0.01).way), NUMBER))


def _coded(text):
    """Numbers that differ where texts do."""
    return np.frombuffer(str(text).encode().ljust(80)[:80], dtype=np.uint8).astype(float)


def _compress(packing, s, k):
    *_, last = jamlab.compress(packing, packing.phi + 0.02, 0.01, by="phi")
    return _at_minimum(last)


def _slow_shear(packing, s, k):
    found = jamlab.slow_shear(packing)
    fields = ("normal", "tangential", "nonaffine")
    return {name: (getattr(found, name), LENGTH) for name in fields}


def _picture(packing, s, k):
    return numbers(light=(jamlab.synthetic_micrograph(packing, 64), NUMBER))


def _tessellation(packing, s, k):
    found = jamlab.tessellation(packing)
    return numbers(area=(found.area, AREA), wall_length=(found.wall_length, LENGTH), sides=(found.sides, NUMBER))


def _order(packing, s, k):
    found = jamlab.orientational_order(packing)
    return numbers(local=(np.abs(found.local), NUMBER), neighbors=(found.neighbors, NUMBER))


def _held(packing, s, k):
    found = jamlab.held_motions(packing)
    names = ("particles", "pairs", "contacts", "self_stresses", "free")
    return {name: (getattr(found, name), NUMBER) for name in names}


def _tensor(packing, s, k):
    found = jamlab.elastic_tensor(packing)
    return numbers(affine=(found.affine, STRESS), relaxed=(found.relaxed, STRESS))


def _motion(packing, s, k):
    """Of modes that drag resists; those of high rates cost hardly any and hold the rounding of its matrix."""
    found = jamlab.mode_motion(packing)
    kept = found.rates < 1e3
    names = ("translation", "rotation", "along", "across", "sliding")
    shares = {name: (np.vdot(getattr(found, name)[kept], found.strengths[kept]), STRESS) for name in names}
    return numbers(rates=(found.rates[kept], NUMBER), **shares)


def _droplets(packing, s, k):
    """In units of eps and l, whatever those of the disks are."""
    found = _at_minimum(jamlab.to_polygons(packing, nv_small=8, nv_large=11))
    return {name: (value, NUMBER) for name, (value, _) in found.items()}


def _fractions(packing, s, k):
    methods = ("exact", "nominal") if packing.model == "dp" else ("exact", "pairs", "triples", "nominal")
    return {method: (jamlab.packing_fraction(packing, method), NUMBER) for method in methods}


def _one(function, powers=NUMBER):
    return lambda packing, s, k: {"value": (function(packing), powers)}


CASES = {
    "area_ratios": Case(_one(jamlab.area_ratios)),
    "bulk_modulus": Case(_moduli(jamlab.bulk_modulus), MINIMUM),
    "choose_flow": Case(_flow_choice, models=("dp",)),
    "complex_modulus": Case(_spectrum),
    "compress": Case(_compress, MINIMUM),
    "contact_lengths": Case(_one(lambda p: jamlab.contact_lengths(p).length, LENGTH), models=("dp",)),
    "contacts": Case(_contacts),
    "creep": Case(_creep, FLOW),
    "displacement_correlation": Case(_correlation),
    "dynamical_matrices": Case(_matrices),
    "edge_lengths": Case(_one(jamlab.edge_lengths, LENGTH), models=("dp",)),
    "elastic_tensor": Case(_tensor),
    "evaluate": Case(_evaluate),
    "exact_method": Case(_one(lambda p: _coded(jamlab.exact_method(p)))),
    "flow_curve": Case(_flow_curve, FLOW, models=("sp",)),
    "held_motions": Case(_held),
    "hessian": Case(_one(lambda p: jamlab.hessian(p).toarray(), STRESS)),
    "local_packing_fraction": Case(_one(jamlab.local_packing_fraction)),
    "lowest_modes": Case(_one(lambda p: jamlab.lowest_modes(p).eigenvalues, STRESS)),
    "measure": Case(_measured),
    "measure_all": Case(_one(lambda p: jamlab.measure_all([p, p], ["pressure"])["pressure"], STRESS)),
    "mode_motion": Case(_motion, models=("dp",)),
    "nonlinear_modulus": Case(_nonlinear),
    "orientational_order": Case(_order),
    "oscillate": Case(_oscillate, FLOW),
    "oscillating_displacements": Case(_displacements),
    "packing_fraction": Case(_fractions),
    "particle_areas": Case(_one(jamlab.particle_areas, AREA)),
    "relax_stress": Case(_relax_stress, FLOW),
    "relaxed": Case(lambda p, s, k: _at_minimum(jamlab.relaxed(_displaced(p, s))), MINIMUM),
    "shape_factors": Case(_one(jamlab.shape_factors)),
    "shear": Case(_all_shear, FLOW),
    "shear_modulus": Case(_moduli(jamlab.shear_modulus, average=True), MINIMUM),
    "slow_shear": Case(_slow_shear, models=("sp",)),
    "synthetic_micrograph": Case(_picture, models=("square",)),
    "tessellation": Case(_tessellation),
    "to_polygons": Case(_droplets, MINIMUM, models=("dense",)),
    "voids": Case(lambda p, s, k: _voids(p)),
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
