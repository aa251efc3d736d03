"""Every public function that takes a packing, and views of a packing that must not change what it gives.

`deviation` calls a function with a packing and with a view of it, undoes what the view does to the numbers, and
compares them.
"""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import motion_of_views
import numpy as np
from motion_of_views import grown as _grown
from packings_of_views import packings
from structure_of_views import (
    ALL,
    AREA,
    EACH,
    ENERGY,
    FORCE,
    LENGTH,
    NUMBER,
    SET,
    STRESS,
    pairs,
    waves,
    waves_of_motion,
)
from tiled_packings import tiled
from vibrations_of_views import damped, localised, matrices, modes, norms, spectrum

import jamlab
from jamlab.packing.natural_units import mean_size
from jamlab.packing.quantities import QUANTITIES

# Largest deviations, over the largest number of an array. Sums in another order and positions at other places round by
# 1e-16 of a box; z, rho and cells keep that, and stable packings well above onset lose four digits in responses.
EXACT = 1e-9
MINIMUM = 1e-6  # minima stop at forces of 1e-12, of droplets 1e-10, over the softest stiffness, 1e-3; strains are 1e-6
FLOW = 1e-2  # the tolerance of steps, over the largest stress

COLUMNS = {"pressure": STRESS, "max_force": FORCE, "void_area": AREA, "contact_energy": ENERGY} | {
    **{"energy": (ENERGY, ALL), "rattlers": (NUMBER, ALL), "voids": (NUMBER, ALL)},
    **dict.fromkeys(("g", "g_x", "b"), STRESS),
    **dict.fromkeys(("contact_length", "shortest_edge", "longest_edge"), LENGTH),
}


@dataclass(frozen=True)
class View:
    """A packing seen otherwise, and what that does to its numbers: lengths times s, stresses times k."""

    packing: jamlab.Packing
    s: float = 1.0
    k: float = 1.0
    order: np.ndarray | None = None  # which particle of the packing each one is
    copies: int = 1
    sign: int = 1  # of shear along x; -1 in a mirror


def _rings(packing, order, ring):
    """State with the particles in an order, and the outline of each, if it has one, as a function makes it."""
    if packing.model == "sp":
        return {"positions": packing.positions[order], "diameters": packing.diameters[order]}
    rings = [ring(each) for each in np.split(packing.positions, packing.offsets[1:-1])]
    rings = [rings[m] for m in order]
    params = packing.params | {"a0": packing.params["a0"][order]}
    return {"positions": np.concatenate(rings), "offsets": np.cumsum([0, *map(len, rings)]), "params": params}


def _permuted(view):
    p, order = view.packing, np.random.default_rng(5).permutation(view.packing.n)
    return replace(view, packing=p.with_state(**_rings(p, order, lambda ring: np.roll(ring, 3, axis=0))), order=order)


def _moved(view, moves):
    return replace(view, packing=view.packing.with_state(positions=view.packing.positions + moves))


def _images(view):
    p = view.packing
    return _moved(view, (np.random.default_rng(6).integers(-2, 3, (p.n, 2)) @ p.box)[p.particle])


def _leaning(view):
    box = view.packing.box.copy()
    box[1] -= 2 * box[0]
    return replace(view, packing=view.packing.with_state(box=box))


def _mirrored(view):
    p, turn = view.packing, np.array([-1.0, 1.0])
    state = _rings(p, np.arange(p.n), lambda ring: ring[::-1])
    state |= {"positions": state["positions"] * turn, "box": p.box * [[1, 1], [-1, 1]]}
    return replace(view, packing=p.with_state(**state), sign=-view.sign)


METRES = 2.0**-18, 2.0**13  # micrometres and 8 kPa: units that change no digit, so that nothing else does either
VIEWS = {
    "permuted": _permuted,
    "translated": lambda view: _moved(view, mean_size(view.packing) * np.array([0.37, -4.1])),
    "images": _images,
    "box + k a": _leaning,
    "180 deg": lambda view: replace(view, packing=view.packing.with_state(positions=-view.packing.positions)),
    "mirror": _mirrored,
    "units, 7e2": lambda view: replace(view, packing=scaled(view.packing, 7e2, 4e-8), s=7e2, k=4e-8),
    "units, 3e-4": lambda view: replace(view, packing=scaled(view.packing, 3e-4, 6e8), s=3e-4, k=6e8),
    "metres": lambda view: replace(view, packing=scaled(view.packing, *METRES), s=METRES[0], k=METRES[1]),
    "supercell": lambda view: replace(view, packing=tiled(view.packing, 2), copies=4),
}


def together(model):
    """Views that the suite takes at once, those of units by turns."""
    units = "units, 3e-4" if model in ("hertz", "dp") else "units, 7e2"
    several = ("permuted", "translated", "images", "box + k a", "180 deg", "mirror", units)
    return {"same": (), "seen otherwise": several, "metres": ("metres",), "supercell": ("supercell",)}


def scaled(packing, s, k):
    """The same packing with lengths times s and stresses times k."""
    powers = {"eps": ENERGY, "k": STRESS, "gamma": (1, -1), "ka": (1, -4), "delta": LENGTH, "eta": LENGTH, "a0": AREA}
    # other laws say here what theirs are measured in
    powers |= dict.fromkeys(("exponent", "stickiness", "adhesion", "adhesion_range"), NUMBER)
    powers |= {"kappa": (1, 1), "kp": STRESS, "kl": STRESS, **dict.fromkeys(("theta0", "p0"), NUMBER)}
    numbers = {name: value for name, value in packing.params.items() if not isinstance(value, str)}
    params = {name: value * _unit(powers[name], s, k) for name, value in numbers.items()}
    changes = {} if packing.diameters is None else {"diameters": s * packing.diameters}
    return packing.with_state(
        positions=s * packing.positions, box=s * packing.box, params={**packing.params, **params}, **changes
    )


def _unit(powers, s, k):
    energy, length = powers
    return (k * s**2) ** energy * s**length


@dataclass(frozen=True)
class Case:
    """How a function is called, and what it must give.

    Attributes:
        call: view -> name -> (numbers, powers of energy and length, with what a view does to them beside).
        tolerance: largest deviation allowed.
        models: packings that the function takes; one for what takes long.
        but: view -> why the numbers are others there.
    """

    call: Callable
    tolerance: float = EXACT
    models: tuple[str, ...] = ("sp", "eps", "hertz", "dp")
    but: dict[str, str] = field(default_factory=dict)


DISKS = ("sp", "eps", "hertz")
LONG = ("eps", "dp")  # of what takes long: rattlers of disks, and droplets


def _fields(function, **powers):
    """Fields of what a function of a packing gives, and their powers."""

    def call(view):
        found = function(view.packing)
        return {name: (getattr(found, name), unit) for name, unit in powers.items()}

    return call


def _one(function, powers=NUMBER):
    return lambda view: {"value": (function(view.packing), powers)}


def _measured(view, quantities=(*set(QUANTITIES) - {"max_force"},)):
    found = jamlab.measure(view.packing, quantities)
    return {name: (value, COLUMNS.get(name, NUMBER)) for name, value in found.items()}


def _at_minimum(packing):
    """What says whether a minimum is the same: not the positions of rattlers."""
    found = _measured(View(packing), ("rho", "z", "pressure", "energy", "g", "b"))
    return found | {"converged": (packing.converged, NUMBER), "area": (packing.area, (AREA, ALL))}


def _moduli(function, **more):
    def call(view):
        methods = ("linear-response", "affine", "finite-strain")
        return {method: (function(view.packing, method, **more), STRESS) for method in methods}

    return call


def _coded(text):
    """Numbers that differ where texts do."""
    return np.frombuffer(str(text).encode().ljust(80)[:80], dtype=np.uint8).astype(float)


def _compress(view):
    *_, last = jamlab.compress(view.packing, view.packing.phi + 0.02, 0.01, by="phi")
    return _at_minimum(last)


def _decompress(view):
    return _at_minimum(jamlab.decompress(view.packing, 0.8 * jamlab.evaluate(view.packing).pressure))


def _contacts(view):
    found = jamlab.contacts(view.packing)
    forces, degree = found.forces, np.bincount(found.pairs.ravel(), minlength=view.packing.n)
    each = {"contacts of each": (degree, (NUMBER, EACH)), "rattlers": (found.rattlers, (NUMBER, EACH))}
    sets = {
        "force": (forces.size, (FORCE, SET)),
        "gap": (forces.gap, (LENGTH, SET)),
        "bearing": (found.n_contacts, (NUMBER, ALL)),
    }
    return (
        each
        | sets
        | {"r": (np.hypot(*found.r.T), (LENGTH, SET)), "z": (found.z, NUMBER), "z_all": (found.z_all, NUMBER)}
    )


def _elastic(view):
    """Elements with an odd number of x change their sign in a mirror."""
    found, x = jamlab.elastic_tensor(view.packing), np.indices((2, 2, 2, 2)).sum(axis=0)
    return {name: (view.sign**x * getattr(found, name), STRESS) for name in ("affine", "relaxed")}


def _evaluated(view):
    found = jamlab.evaluate(_grown(view.packing))
    named = {"energy": (found.energy, (ENERGY, ALL)), "forces": (np.hypot(*found.forces.T), (FORCE, SET))}
    return named | {"stress": (found.stress * [[1, view.sign], [view.sign, 1]], STRESS)}


def _order(view):
    found = jamlab.hexatic_order(view.packing)
    return {"local": (np.abs(found.local), (NUMBER, EACH)), "neighbors": (found.neighbors, (NUMBER, EACH))}


def _motion(view):
    """Of modes that drag resists; those of high rates cost hardly any and hold the rounding of its matrix."""
    found = jamlab.mode_character(view.packing)
    kept = (found.rates < 1e3) & (found.strengths > 1e-9 * found.strengths.max())
    names = ("translation", "rotation", "along", "across", "sliding")
    return {name: (np.vdot(getattr(found, name)[kept], found.strengths[kept]), STRESS) for name in names} | {
        "rates": (found.rates[kept], NUMBER)
    }


def _droplets(view):
    """In units of eps and l, whatever those of the disks are."""
    found = _at_minimum(jamlab.droplets_from_disks(view.packing, law={"nv_small": 8, "nv_large": 11}))
    return {name: (value, NUMBER) for name, (value, _) in found.items()}


def _fractions(view):
    methods = ("exact", "nominal") if view.packing.model == "dp" else ("exact", "pairs", "nominal")
    return {method: (jamlab.packing_fraction(view.packing, method), NUMBER) for method in methods}


def _slow(view):
    """A mirror turns the shear, and with it approach; what slides keeps its sense of turning."""
    found = jamlab.nonaffine_response(view.packing)
    lengths = {"normal": view.sign * found.normal, "tangential": np.abs(found.tangential)}
    return {name: (value, (LENGTH, SET)) for name, value in lengths.items()}


def _along(drive, **powers):
    """Fields of a flow of a view; both shear and its answer change their sign in a mirror."""

    def call(view):
        found = drive(view)
        return {name: (getattr(found, name) * (view.sign if name == "stress" else 1), p) for name, p in powers.items()}

    return call


ORIGIN = dict.fromkeys(("translated", "180 deg"), "lanes and bins are cut from the origin of the box")
FARTHER = {"supercell": "half the box is twice as far"}
DRAWN = dict.fromkeys(("translated", "180 deg", "mirror", "supercell"), "pixels lie where the picture begins")
RANDOM = dict.fromkeys(("permuted", "180 deg", "mirror", "supercell"), "outlines are turned at random, by their number")
WAVES = {"supercell": "a cell of four has four times as many wavevectors, and a spectrum four times as high"}
PER_CELL = {"supercell": "a cell of four has motions of its own"}
IMAGES = {"supercell": "a particle that meets two images of another has one element for both"}
ONE_WAY = {"mirror": "it goes one way, along x"}
CHAOS = {"supercell": "copies part in steady flow, where what rounding leaves grows"}

CASES = {
    "relative_areas": Case(_one(jamlab.relative_areas, (NUMBER, EACH))),
    "bulk_modulus": Case(_moduli(jamlab.bulk_modulus), MINIMUM, LONG),
    "choose_flow": Case(_one(lambda p: _coded(jamlab.choose_flow(p, omega=1.0, amplitude=0.01).way)), models=("dp",)),
    "complex_modulus": Case(spectrum, models=(*Case.models, "sticky", "sticky eps", "vesicles")),
    "compress": Case(_compress, MINIMUM, LONG),
    "contact_lengths": Case(_one(lambda p: jamlab.contact_lengths(p).length, (LENGTH, SET)), models=("dp",)),
    "contacts": Case(_contacts),
    "creep": Case(
        _along(lambda v: jamlab.creep(v.packing, 1e-5 * v.k, 0.5, tolerance=1e-2), strain=NUMBER),
        FLOW,
        LONG,
        but=ONE_WAY,
    ),
    "damped_vibrations": Case(damped, but=PER_CELL),
    "decompress": Case(_decompress, MINIMUM, ("sp", *LONG)),
    "displacement_correlation": Case(
        _fields(lambda p: jamlab.displacement_correlation(p, 1e-2), delta=LENGTH, correlation=NUMBER),
        but=ORIGIN | FARTHER,
    ),
    "displacement_spectrum": Case(waves_of_motion, but=WAVES),
    "dynamical_matrices": Case(matrices, but=IMAGES),
    "elastic_tensor": Case(_elastic),
    "evaluate": Case(_evaluated, models=(*Case.models, "sticky", "sticky eps", "adhesive", "vesicles")),
    "flow_curve": Case(
        _one(lambda p: jamlab.flow_curve(p, [1.0], strain=1.2, discard=0.1).stress, STRESS),
        FLOW,
        models=("eps",),
        but=ONE_WAY | CHAOS,
    ),
    "maxwell_count": Case(
        _fields(
            jamlab.maxwell_count,
            **dict.fromkeys(("n_particles", "pairs", "contacts"), (NUMBER, ALL)),
            floppy_modes=NUMBER,
        ),
        but=PER_CELL,
    ),
    "rigid_clusters": Case(
        _one(lambda p: jamlab.rigid_clusters(p).sizes, (NUMBER, SET)), models=("sticky", "sticky eps"), but=PER_CELL
    ),
    "hessian": Case(
        _one(lambda p: norms(jamlab.hessian(p).toarray()), (STRESS, SET)),
        models=(*Case.models, "adhesive", "vesicles"),
        but=IMAGES,
    ),
    "local_strain": Case(motion_of_views.strained),
    "mean_square_displacement": Case(motion_of_views.walked),
    "self_overlap": Case(motion_of_views.kept),
    "local_packing_fraction": Case(_one(jamlab.local_packing_fraction, (NUMBER, EACH))),
    "lowest_modes": Case(modes, but=PER_CELL),
    "quasilocalized_modes": Case(localised, but=PER_CELL),
    "mean_spectra": Case(
        _fields(lambda p: jamlab.mean_spectra([p], [1e-2, 1.0])[0], storage=STRESS, loss=STRESS), models=("eps",)
    ),
    "measure": Case(_measured),
    "mode_character": Case(_motion, models=("dp",)),
    "nonlinear_modulus": Case(
        lambda v: _fields(
            lambda p: jamlab.nonlinear_modulus(p, [1e-2, 1.0], jamlab.ContactDamping(alpha=0.5), stress=1e-2 * v.k),
            storage=STRESS,
            loss=STRESS,
        )(v)
    ),
    "hexatic_order": Case(_order),
    "oscillate": Case(
        _fields(
            lambda p: jamlab.oscillate(p, 10.0, 1e-4, cycles=2, points_per_cycle=16, tolerance=1e-2),
            storage=STRESS,
            loss=STRESS,
        ),
        FLOW,
        LONG,
    ),
    "displacement_response": Case(
        _one(lambda p: np.abs(jamlab.displacement_response(p, 1e-2)[1]).ravel(), ((-1, 3), SET))
    ),
    "packing_fraction": Case(_fractions),
    "pair_correlation": Case(pairs),
    "particle_areas": Case(_one(jamlab.particle_areas, (AREA, EACH))),
    "quasistatic_shear": Case(
        _along(
            lambda v: jamlab.quasistatic_shear(v.packing, [v.sign * 2e-3, v.sign * 1e-3], 2e-3),  # and back
            **{"stress": STRESS, "energy": STRESS, "pressure": STRESS},
        ),
        FLOW,
        LONG,
    ),
    "relax_stress": Case(
        _along(lambda v: jamlab.relax_stress(v.packing, v.sign * 1e-4, 0.3), modulus=STRESS), FLOW, LONG
    ),
    "relax": Case(
        lambda v: _at_minimum(jamlab.relax(_grown(v.packing))), MINIMUM, (*LONG, "sticky", "adhesive", "vesicles")
    ),
    "relax_radii": Case(lambda v: _at_minimum(jamlab.relax_radii(v.packing)), MINIMUM, ("hertz",), PER_CELL),
    "shape_factors": Case(_one(jamlab.shape_factors, (NUMBER, EACH))),
    "shear": Case(
        _along(
            lambda v: jamlab.shear(v.packing, v.sign * 0.1, strain=0.02, rows=4),
            **{"stress": STRESS, "pressure": STRESS, "z_all": NUMBER},
        ),
        FLOW,
        LONG,
    ),
    "shear_modulus": Case(_moduli(jamlab.shear_modulus), MINIMUM, (*LONG, "sticky", "adhesive", "vesicles")),
    "nonaffine_response": Case(_slow, models=DISKS),
    "spectral_density": Case(waves(jamlab.spectral_density, AREA), but=WAVES),
    "structure_factor": Case(waves(jamlab.structure_factor, NUMBER), but=WAVES),
    "stop_flow": Case(
        _along(
            lambda v: jamlab.stop_flow(_grown(v.packing), 0.3, background_drag=1e-2), stress=STRESS, pressure=STRESS
        ),
        FLOW,
        ("eps",),
    ),
    "synthetic_micrograph": Case(
        _one(lambda p: jamlab.synthetic_micrograph(p, 64)),
        models=("square",),
        but=DRAWN | {"box + k a": "a picture is upright"},
    ),
    "tessellation": Case(
        _fields(jamlab.tessellation, area=(AREA, EACH), wall_length=(LENGTH, SET), sides=(NUMBER, EACH))
    ),
    "droplets_from_disks": Case(_droplets, MINIMUM, models=("dense",), but=RANDOM),
    "voids": Case(
        _fields(jamlab.voids, sides=(NUMBER, SET), area=(AREA, SET), perimeter=(LENGTH, SET), percolating=(NUMBER, SET))
    ),
    "remove_rattlers": Case(_one(lambda p: jamlab.remove_rattlers(p).n, (NUMBER, ALL))),
    "count_zero_modes": Case(_one(jamlab.count_zero_modes), but=PER_CELL),
}
NOT_COMPARED = {  # functions that take a packing and give no numbers of it, or those of another function
    **dict.fromkeys(("write", "write_page", "write_contacts", "write_movie"), "files hold what the packing holds"),
    "t1_events": "boxes in which a pair meets twice are refused: tests/motion/test_t1_events.py",
    **dict.fromkeys(("density_of_states", "density_by_size"), "counts of the modes that lowest_modes gives"),
    "universe": "coordinates as they are",
    **dict.fromkeys(("swap_sizes", "anneal"), "random numbers go by the order of particles"),
    **dict.fromkeys(("with_walls", "slab"), "walls stand at the edge of the box: elsewhere they are others"),
    "flow_cost": "seconds",
}


def public_functions_of_packings():
    """Names of public functions one of whose arguments is a packing, or several."""
    found = set()
    for name in jamlab.__all__:
        function = getattr(jamlab, name)
        if inspect.isfunction(function):
            hints = (str(p.annotation) for p in inspect.signature(function).parameters.values())
            if any("Packing" in hint for hint in hints):
                found.add(name)
    return found


def deviation(name, model, views=()):
    """Largest relative deviation of a function's numbers in a view, over the largest number of each array."""
    case = CASES[name]
    view = View(packings()[model])
    for each in views:
        if each not in case.but:
            view = VIEWS[each](view)
    wanted, found = _reference(name, model), case.call(view)
    assert wanted.keys() == found.keys()
    return max(_off(wanted[label][0], *found[label], view) for label in wanted)


def _off(wanted, found, powers, view):
    powers, kind = powers if isinstance(powers[0], tuple) else (powers, "")
    a = np.asarray(wanted, dtype=float)
    b = np.asarray(found, dtype=float) / _unit(powers, view.s, view.k)
    if kind == EACH:
        a = np.tile(a, view.copies)[slice(None) if view.order is None else view.order]
    elif kind == SET:
        a, b = np.sort(np.tile(a, view.copies)), np.sort(b)
    elif kind == ALL:
        a = a * view.copies
    if a.shape != b.shape or not np.array_equal(np.isnan(a), np.isnan(b)):
        return np.inf
    kept = ~np.isnan(a)
    largest, off = np.abs(a[kept]).max(initial=0.0), np.abs(a - b)[kept].max(initial=0.0)
    return float(off / largest if largest else off)


@cache
def _reference(name, model):
    return CASES[name].call(View(packings()[model]))
