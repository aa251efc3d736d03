"""Every feature of a packing with every public function that gives a static response, a stress or an energy: each cell
of the table agrees with plain numpy, or is refused by name. `pytest -s` prints the table; `-m slow` the rest of it.

A new public function of packings fails the test until it is placed here: in ROWS, or in ELSEWHERE with the tests that
compare it.
"""

import warnings
from functools import cache

import numpy as np
import pytest
from features_of_packings import FEATURES, TURN
from invariant_cases import public_functions_of_packings
from own_response import ALONG_Y, ISOTROPIC, PURE, SIMPLE, Own, simple_along

import jamlab
from jamlab.measure import why_no_modulus
from jamlab.packing.quantities import ENERGY, FORCE, MEASURED, STRESS

ELSEWHERE = {
    **dict.fromkeys(
        ("contacts", "contact_lengths", "droplets_from_disks", "hexatic_order", "local_packing_fraction"), "geometry"
    ),
    **dict.fromkeys(("packing_fraction", "particle_areas", "relative_areas", "remove_rattlers", "slab"), "geometry"),
    **dict.fromkeys(("shape_factors", "tessellation", "voids", "with_walls"), "geometry: tests/geometry"),
    **dict.fromkeys(("pair_correlation", "spectral_density", "structure_factor"), "structure: tests/structure"),
    **dict.fromkeys(("anneal", "relax_radii", "swap_sizes"), "other minima: tests/protocols"),
    "density_of_states": "all modes, binned: tests/mechanics/test_density_of_states.py",
    "density_by_size": "the same of several N: tests/mechanics/test_density_by_size.py",
    "quasilocalized_modes": "minima: tests/mechanics/test_quasilocalized_modes.py",
    "damped_vibrations": "with masses: tests/rheology/test_inertia.py",
    **dict.fromkeys(("maxwell_count", "rigid_clusters"), "counts: tests/mechanics/test_maxwell_count.py"),
    **dict.fromkeys(("creep", "flow_curve", "oscillate", "relax_stress", "shear", "stop_flow"), "in time: tests/flow"),
    **dict.fromkeys(("choose_flow", "flow_cost"), "estimates of runs: tests/flow"),
    **dict.fromkeys(
        ("displacement_correlation", "mean_spectra", "mode_character", "nonlinear_modulus"),
        "at a frequency: tests/rheology",
    ),
    "displacement_spectrum": "sums of waves: tests/rheology/test_displacement_spectrum.py",
    **dict.fromkeys(("synthetic_micrograph", "universe", "write", "write_contacts"), "pictures and files"),
    **dict.fromkeys(("local_strain", "mean_square_displacement", "self_overlap", "t1_events"), "motion: tests/motion"),
    **dict.fromkeys(("write_movie", "write_page"), "pictures and files"),
}


@cache
def feature(name):
    """The packing, and its own numbers."""
    p = FEATURES[name]()
    return p, Own(p)


# rows: what a function gives of a packing, and what it must be --------------------------------------------------------

ROWS = {}  # name of a row -> check, words by which walls, droplets and other features are refused
LINEAR, STRAIN = 1e-6, 3e-4  # largest deviation of linear response, and of differences over small strains


def row(name, tolerance=LINEAR, **refused):
    """Declare a row. `refused`: feature -> words of the message."""

    def register(check):
        ROWS[name] = check, tolerance, refused
        return check

    return register


def traits(p):
    """What refusals go by."""
    return {
        "walls": p.walls,
        "flat": bool(p.flat_walls.any()),
        "droplets": p.model == "dp",
        "sticky": "stickiness" in p.params,
        "single": len(p.positions) == 1,
    }


def generators(p):
    """Strains that the boundary conditions define."""
    return (SIMPLE, ALONG_Y) if p.walls else (SIMPLE, ALONG_Y, PURE, simple_along(TURN), ISOTROPIC)


WALLS = {"walls": "walls"}


@row("evaluate")
def _evaluate(p, own):
    found, scale = jamlab.evaluate(p), own.stiffness
    push = -own.gradient * own.free.reshape(-1, 2)
    yield found.energy, own.energy
    yield found.forces, push, scale * np.sqrt(own.area / p.n)
    yield found.pressure, own.pressure
    for m in generators(p):
        yield -np.sum(found.stress * m), own.stress(m), np.abs(found.stress).max()


@row("measure")
def _measure(p, own):
    wanted = {
        "pressure": own.pressure,
        "energy": own.energy,
        "g_x": own.modulus(SIMPLE),
        "b": own.bulk(),
        "contact_energy": _contact_energy(p, own) / len(p.positions),
    }
    found = jamlab.measure(p, [*wanted, "max_force"])
    for name, value in wanted.items():
        yield found[name], value, own.stiffness if name == "g_x" else None
    yield found["max_force"], np.hypot(*(own.gradient * own.free.reshape(-1, 2)).T).max(), own.stiffness


def _contact_energy(p, own):
    """All of disks; of droplets what is neither line tension nor areas."""
    if p.model == "sp":
        return own.energy
    contacts = [term for term in own.terms if term.shift.shape[1] > 1]
    return sum(term.energy(own._at(term)).real.sum() for term in contacts)


@row("measure g", **WALLS)
def _measure_g(p, own):
    found = jamlab.measure(p, "g")["g"]
    if np.isnan(found):
        raise jamlab.InputError(why_no_modulus(p))
    assert why_no_modulus(p) == ""
    yield found, np.mean([own.modulus(simple_along(a)) for a in np.pi / 3 * np.arange(3)])


@row("relax")
def _relax(p, own):
    pushed = p.positions + 1e-5 * np.sqrt(own.area / p.n) * np.sin(7 * p.positions) * own.free.reshape(-1, 2)
    back = Own(jamlab.relax(p.with_state(positions=pushed)))
    scale = own.stiffness
    yield back.energy, own.energy, max(abs(own.energy), scale * own.area * 1e-6)
    yield back.gradient * back.free.reshape(-1, 2), 0.0, scale * np.sqrt(own.area / p.n)


@row("shear_modulus")
def _g(p, own):
    yield jamlab.shear_modulus(p, direction="simple"), own.modulus(SIMPLE), own.stiffness * 1e-2
    yield jamlab.shear_modulus(p, "affine", direction="simple"), own.modulus(SIMPLE, affine=True), own.stiffness
    yield jamlab.shear_modulus(p, direction=np.pi), own.modulus(SIMPLE), own.stiffness * 1e-2


@row("shear_modulus angle", **WALLS)
def _g_angle(p, own):
    yield jamlab.shear_modulus(p, direction=[TURN, 2 * TURN]), [own.modulus(simple_along(k * TURN)) for k in (1, 2)]
    yield jamlab.shear_modulus(p, "affine", direction=TURN), own.modulus(simple_along(TURN), affine=True)


@row("shear_modulus pure", **WALLS)
def _g_pure(p, own):
    yield jamlab.shear_modulus(p, direction="pure"), own.modulus(PURE)


@row("shear_modulus average", **WALLS)
def _g_average(p, own):
    yield (
        jamlab.shear_modulus(p),
        np.mean([own.modulus(simple_along(a)) for a in np.pi / 3 * np.arange(3)]),
    )


@row("shear_modulus finite-strain", STRAIN)
def _g_strain(p, own):
    yield jamlab.shear_modulus(p, "finite-strain", direction="simple"), own.modulus(SIMPLE), own.stiffness * 1e-2


@row("shear_modulus finite-strain angle", STRAIN, **WALLS)
def _g_strain_angle(p, own):
    yield jamlab.shear_modulus(p, "finite-strain", direction=TURN), own.modulus(simple_along(TURN))


@row("bulk_modulus")
def _b(p, own):
    yield jamlab.bulk_modulus(p), own.bulk()
    yield jamlab.bulk_modulus(p, "affine"), own.stiffness


@row("bulk_modulus finite-strain", STRAIN)
def _b_strain(p, own):
    yield jamlab.bulk_modulus(p, "finite-strain"), own.bulk()


def _load(own):
    """Force per strain that a response balances."""
    return max(np.abs(own.along(m)[1]).max() for m in generators(own.p)) + 1e-3 * own.stiffness * np.sqrt(own.area)


@row("elastic_tensor", **WALLS)
def _tensor(p, own):
    found = jamlab.elastic_tensor(p)
    for m in generators(p):
        beside = np.sum(jamlab.evaluate(p).stress * (m @ m))  # exp(g m) is quadratic in the displacement gradient
        for affine, c in ((True, found.affine), (False, found.relaxed)):
            yield np.einsum("ij,ijkl,kl->", m, c, m) - beside, own.modulus(m, affine), own.stiffness * 1e-2
        moved = np.einsum("nkij,ij->nk", found.displacements, m)
        yield own.hessian @ moved.ravel(), own.hessian @ own.response(m).ravel(), _load(own)


@row("nonaffine_response", droplets="droplets")
def _nonaffine(p, own):
    found, (contacts,) = jamlab.nonaffine_response(p), own.terms
    ((first, _),) = own.of_strain(SIMPLE)
    r = p.positions[contacts.sites] + contacts.shift
    r = r[:, 1] - r[:, 0]
    normal = r / np.hypot(*r.T)[:, None]
    moved = first + own.response(SIMPLE)[contacts.sites]
    relative = moved[:, 1] - moved[:, 0]
    flat = p.diameters[contacts.sites[:, 1]] == 0
    normal[flat] = np.sign(r[flat]) * [0, 1]
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    for name, along in (("normal", normal), ("tangential", tangent)):
        wanted = np.sort(np.abs((relative * along).sum(axis=1)))
        yield np.sort(np.abs(getattr(found, name)))[-len(wanted) :], wanted, np.hypot(*relative.T).max()


@row("hessian")
def _hessian(p, own):
    yield jamlab.hessian(p).toarray(), own.hessian


@row("lowest_modes")
def _lowest(p, own):
    count = min(6, int(own.free.sum()) - 1)
    yield jamlab.lowest_modes(p, count).eigenvalues, own.modes[0][:count], np.abs(own.modes[0]).max(initial=0.0)


@row("count_zero_modes")
def _zero(p, own):
    yield jamlab.count_zero_modes(p), np.sum(np.abs(own.modes[0]) < own.least_stiff)


def _bordered(p, own, m, **how):
    k = jamlab.dynamical_matrices(p, **how)[0].toarray()
    size = len(own.hessian)
    second, mixed = own.along(m)
    yield k[:size, :size], own.hessian
    if not p.walls:  # walls move beside gamma
        yield k[-1, -1], second, own.stiffness * own.area
    yield k[-1, :size], mixed, np.abs(own.hessian).max() * np.sqrt(own.area / p.n)


@row("dynamical_matrices")
def _matrices(p, own):
    yield from _bordered(p, own, SIMPLE)


@row("dynamical_matrices direction", **WALLS)
def _matrices_along(p, own):
    yield from _bordered(p, own, PURE, direction="pure")
    yield from _bordered(p, own, simple_along(TURN), direction=TURN)


SLOW = 1e-9  # frequency, far below all rates


@row("complex_modulus", single="single")
def _slow(p, own):
    for method in ("dense", "direct"):
        found = jamlab.complex_modulus(p, [SLOW], method=method)
        yield found.storage[0], own.modulus(SIMPLE), own.stiffness * 1e-2
        yield found.g0, own.modulus(SIMPLE), own.stiffness * 1e-2


@row("complex_modulus direction", **WALLS, single="single")
def _slow_along(p, own):
    for direction, m in (("pure", PURE), (TURN, simple_along(TURN))):
        yield jamlab.complex_modulus(p, [SLOW], direction=direction).storage[0], own.modulus(m), own.stiffness * 1e-2


@row("displacement_response", 1e-5, single="single")
def _displacements(p, own):
    backbone, u = jamlab.displacement_response(p, SLOW)
    slow, moved = jamlab.complex_modulus(p, [SLOW]), np.zeros_like(p.positions)
    kept = np.isin(p.positions, backbone.positions).all(axis=1)
    moved[kept] = (u * (slow.storage[0] + 1j * slow.loss[0])).real  # per strain; flat walls bear no stress
    yield own.hessian @ moved.ravel(), own.hessian @ own.response(SIMPLE).ravel(), _load(own)
    fixed, f = ~own.free.reshape(-1, 2), np.eye(2) + SIMPLE
    yield moved * fixed, (own.carried(f) - p.positions @ f.T) * fixed, np.sqrt(own.area)


@row("quasistatic_shear", STRAIN)
def _sheared(p, own):
    found = jamlab.quasistatic_shear(p, 1e-6, 1e-6, force_tolerance=1e-13)
    slope = (found.stress[-1] - found.stress[0]) / 1e-6
    yield slope, own.modulus(SIMPLE), own.stiffness
    yield found.stress[0], own.stress(SIMPLE), own.stiffness * 1e-3
    yield found.pressure[0], own.pressure
    yield found.energy[0] * own.area, own.energy


@row("quasistatic_shear direction", STRAIN, **WALLS)
def _sheared_along(p, own):
    found = jamlab.quasistatic_shear(p, 1e-6, 1e-6, direction=TURN, force_tolerance=1e-13)
    yield (found.stress[-1] - found.stress[0]) / 1e-6, own.modulus(simple_along(TURN)), own.stiffness
    yield found.stress[0], own.stress(simple_along(TURN)), own.stiffness * 1e-3


@row("quasistatic_shear pressure")
def _at_pressure(p, own):
    found = jamlab.quasistatic_shear(p, 1e-4, 1e-4, pressure="constant")
    assert found.converged.all()
    yield Own(found.packing).pressure, own.pressure, own.stiffness * 1e-2


@row("compress", STRAIN)
def _compressed(p, own):
    step = (2e-6 if p.model == "dp" else 3e-7) * p.phi
    (up,) = jamlab.compress(p, to=p.phi + step, step=step, by="phi")
    found, area = jamlab.measure([p, up], ["pressure", "energy"]), np.array([p.area, up.area])
    # the shear-stabilized ensemble lets the box shear as well
    wanted = own.bulk() if p.ensemble == "fixed-box" else own.bulk_of_box()
    yield -np.diff(found["pressure"]) / np.diff(np.log(area)), wanted, 0.1 * own.stiffness
    yield -np.diff(found["energy"]) / np.diff(area), own.pressure, max(abs(own.pressure), 1e-3 * own.stiffness)
    yield Own(up).pressure - found["pressure"][1], 0.0, own.stiffness


@row("decompress", sticky="stickiness")
def _decompressed(p, own):
    end = jamlab.decompress(p, 0.9 * own.pressure)
    there = Own(end)
    yield there.pressure, 0.9 * own.pressure
    yield there.gradient * there.free.reshape(-1, 2), 0.0, own.stiffness * np.sqrt(own.area / p.n)


# the table ------------------------------------------------------------------------------------------------------------


def cell(name, feature_name):
    """Largest deviation of a cell, or the message that refuses it."""
    check, _, _ = ROWS[name]
    p, own = feature(feature_name)
    worst = 0.0
    try:
        for found, wanted, *scale in check(p, own):
            found, wanted = np.asarray(found, dtype=float), np.asarray(wanted, dtype=float)
            size = np.abs(wanted).max() if not scale or scale[0] is None else max(np.abs(wanted).max(), scale[0])
            worst = max(worst, float(np.abs(found - wanted).max(initial=0.0) / (size or 1.0)))
    except jamlab.JamlabError as error:
        return str(error)
    return worst


def expected_words(name, feature_name):
    """Words of the refusals that a cell may have; none where it must be right."""
    has = traits(feature(feature_name)[0])
    return [words for trait, words in ROWS[name][2].items() if has[trait]]


def test_no_function_of_a_packing_is_forgotten():
    placed = {name.split()[0] for name in ROWS} | set(ELSEWHERE)
    assert placed == public_functions_of_packings()
    assert not {name.split()[0] for name in ROWS} & set(ELSEWHERE)
    known = {name for name, each in MEASURED.items() if each.dimension in (ENERGY, STRESS, FORCE)}
    assert known == {"pressure", "energy", "contact_energy", "g", "g_x", "b", "max_force"}


DEAR = {"relax", "measure", "complex_modulus", "displacement_response", "quasistatic_shear", "compress", "decompress"}
TRAITS = ["leaning", "shear-stab", "expon", "lognormal", "sticky", "fixed", "rough", "flat", "N = 1", "droplet", "eps"]


def left_out(k, j):
    """Whether a cell of two numbers waits for -m slow: in rows that take long two of three features of disks, unless
    the row would miss one of its traits."""
    row, features = [*ROWS][k], [*FEATURES]
    if "droplet" in features[j] or (k + j) % 3 == 0 or not (row.split()[0] in DEAR or "finite" in row):
        return False
    met = " ".join(features[-k % 3 :: 3])
    return all(trait in met for trait in TRAITS if trait in features[j])


@pytest.mark.parametrize("rest", [False, pytest.param(True, marks=pytest.mark.slow)], ids=["pairs", "rest"])
def test_every_cell_is_right_or_refused_by_name(rest):
    wrong, right, refused, worst = [], 0, 0, {LINEAR: 0.0, STRAIN: 0.0}
    lines = []
    for k, (name, (_, tolerance, _)) in enumerate(ROWS.items()):
        marks = []
        for j, feature_name in enumerate(FEATURES):
            if left_out(k, j) != rest:
                marks.append("  .")
                continue
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", jamlab.JamlabWarning)  # G of small packings may be negative
                found, words = cell(name, feature_name), expected_words(name, feature_name)
            if isinstance(found, str):
                if not any(word in found for word in words):
                    wrong.append(f"{name} of {feature_name}: {found}")
                refused += 1
                marks.append("  -")
                continue
            if words or not found <= tolerance:
                wrong.append(f"{name} of {feature_name}: off by {found:.2g}" + (", not refused" if words else ""))
            right += 1
            kind = STRAIN if tolerance == STRAIN else LINEAR
            worst[kind] = max(worst[kind], found)
            marks.append(f"{np.log10(found):3.0f}" if found else "  0")
        lines.append(f"{name:34}" + " ".join(marks))
    print("\nlog10 of the largest deviation; -: refused by name; .: left out here. Columns:", ", ".join(FEATURES))
    print("\n".join(lines))
    print(
        f"{len(ROWS)} functions x {len(FEATURES)} features: {right} cells right, {refused} refused by name; worst "
        f"agreement {worst[LINEAR]:.1g} (exact), {worst[STRAIN]:.1g} (over a small strain)"
    )
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", ["rough", "flat", pytest.param("droplets, rough", marks=pytest.mark.slow)])
def test_the_box_of_walls_may_not_be_stretched(name):
    p, _ = feature(name)
    with pytest.raises(jamlab.InputError, match="walls keep their shape"):
        p.with_state(ensemble="shear-stabilized")
