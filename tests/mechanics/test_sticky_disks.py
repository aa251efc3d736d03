"""Disks that attract: energy and forces against plain loops, a crystal under tension, floppy networks, refusals."""

from itertools import product

import numpy as np
import pytest
from deck_runs import number, run

import jamlab
from jamlab.laws.sticky import StickyLaw
from jamlab.mechanics.stiffness import forces, hessian
from jamlab.protocols.decompression import decompress


def plain(p):
    """Energy, forces and stress of springs that pull, pair by pair."""
    a = p.params["stickiness"] * p.diameters.mean()
    energy, force, stress = 0.0, np.zeros((p.n, 2)), np.zeros((2, 2))
    for i, j, m, n in product(range(p.n), range(p.n), (-1, 0, 1), (-1, 0, 1)):
        r = p.positions[j] - p.positions[i] + np.array([m, n]) @ p.box
        s, d = (p.diameters[i] + p.diameters[j]) / 2, np.hypot(*r)
        if d == 0 or d >= s + 2 * a:
            continue
        k = p.params["k"] if p.units == "k" else p.params["eps"] / s**2
        x = s - d
        u, push = (k * (x * x / 2 - a * a), k * x) if x > -a else (-k * (x + 2 * a) ** 2 / 2, -k * (x + 2 * a))
        energy, stress = energy + u / 2, stress + push / d * np.outer(r, r) / 2
        force[i] -= push * r / d
    return energy, force, stress / p.area


def wide(units="k", sizes=None, stickiness=0.03):
    """Random disks, inside of a shell, outside of it, and overlapping."""
    n = 32 if sizes is None else len(sizes)
    p = jamlab.pack(n, 1e-3, 1, sizes=sizes)
    params = {units: 1.3, "stickiness": stickiness}
    moved = 1.015 * p.positions + 0.02 * np.random.default_rng(1).standard_normal((n, 2))
    return jamlab.Packing("sp", 1.015 * p.box, moved, params, units, p.diameters)


SIXTY_SIX = np.linspace(0.8, 1.3, 66)


@pytest.mark.parametrize(
    ("units", "sizes"),
    [
        pytest.param("k", None, id="k, two sizes"),
        pytest.param("eps", SIXTY_SIX, id="eps, 66 sizes"),
        pytest.param("eps", None, id="eps, two sizes", marks=pytest.mark.slow),
        pytest.param("k", SIXTY_SIX, id="k, 66 sizes", marks=pytest.mark.slow),
    ],
)
def test_law_of_lammps_is_that_of_plain_loops(units, sizes, tmp_path):
    p = wide(units, sizes)
    gap = jamlab.contacts(p).forces.gap / p.diameters.mean()
    assert (gap < 0).any() and ((gap > 0) & (gap < 0.03)).any() and (gap > 0.03).any()
    e, (energy, force, stress) = jamlab.evaluate(p), plain(p)
    np.testing.assert_allclose(e.energy, energy, rtol=0, atol=1e-12)
    for found in (e.forces, forces(p)):
        np.testing.assert_allclose(found, force, rtol=0, atol=1e-12)
    np.testing.assert_allclose(e.stress, stress, rtol=0, atol=1e-12)
    v, h = np.random.default_rng(0).standard_normal(force.shape), 1e-6
    ahead, behind = (forces(p.with_state(positions=p.positions + step * v)) for step in (h, -h))
    np.testing.assert_allclose(hessian(p) @ v.ravel(), (behind - ahead).ravel() / (2 * h), rtol=0, atol=1e-7)
    for name, write in (("data", jamlab.write), ("h5", jamlab.write), ("dump", jamlab.write)):
        write(tmp_path / f"p.{name}", p if name == "data" else [p])
        assert jamlab.read(tmp_path / f"p.{name}").params == p.params


def crystal(gap, stickiness=0.05, rows=6):
    """Triangular lattice of disks of diameter 1."""
    r, grid = 1 + gap, np.array(list(product(range(rows), range(rows))), dtype=float)
    positions = r * np.column_stack([grid[:, 0] + 0.5 * (grid[:, 1] % 2), np.sqrt(0.75) * grid[:, 1]])
    box = r * np.diag([rows, np.sqrt(0.75) * rows])
    return jamlab.Packing("sp", box, positions, {"k": 1.0, "stickiness": stickiness}, "k", np.ones(rows * rows))


def test_crystal_unjams_at_its_tensile_strength():
    """p = -sqrt(3) f/r, largest at a gap of the shell, 0.05; beyond, bonds soften and the crystal tears."""
    start = crystal(0.0)
    gaps = np.array([0.02, 0.0499, 0.06])
    held = [jamlab.relax(crystal(gap)) for gap in gaps]
    for p, gap in zip(held[:2], gaps, strict=False):
        assert p.converged and jamlab.contacts(p).z == 6
        pressure = jamlab.evaluate(p).pressure
        np.testing.assert_allclose(pressure, -np.sqrt(3) * gap / (1 + gap), rtol=1e-12)
        # springs of stiffness k and prestress t = f/r: G = sqrt(3)/4 (k + 3 t) at fixed box, less p
        np.testing.assert_allclose(
            jamlab.shear_modulus(p), jamlab.shear_modulus(p, "finite-strain"), rtol=1e-6, atol=1e-9
        )
    assert jamlab.contacts(start).z == 6 and jamlab.shear_modulus(start, direction="simple") == pytest.approx(
        np.sqrt(3) / 4, rel=1e-10
    )
    assert not held[2].converged or jamlab.contacts(held[2]).z < 6
    sweep = list(jamlab.compress(jamlab.pack(64, 0.0, 2, law={"stickiness": 0.05}), 0.5, 0.06, by="phi"))
    moduli = [jamlab.shear_modulus(p, direction="simple") for p in sweep]
    assert min(jamlab.evaluate(p).pressure for p in sweep) < -1e-3 and abs(moduli[-1]) < 1e-6 < 1e-2 < max(moduli)


@pytest.mark.parametrize("pressure", [pytest.param(1e-2, marks=pytest.mark.slow), 0.0, -3e-3])
def test_packings_at_pressures_of_either_sign(pressure):
    p = jamlab.pack(48, pressure, 3, law={"stickiness": 0.02})
    assert p.converged and abs(jamlab.evaluate(p).pressure - pressure) < 1e-10
    c = jamlab.contacts(p)
    assert (c.forces.gap > 0).any() and (np.bincount(c.pairs[c.bearing].ravel(), minlength=48)[~c.rattlers] >= 2).all()
    for modulus in (jamlab.shear_modulus, jamlab.bulk_modulus):
        np.testing.assert_allclose(modulus(p), modulus(p, "finite-strain"), rtol=1e-6)
    count = jamlab.maxwell_count(p)
    assert (
        count.contacts == 2 * count.n_particles - 2 - count.floppy_modes + count.self_stress_states
        and not count.floppy_modes
    )
    assert jamlab.count_zero_modes(p) <= 2 + 2 * int(c.rattlers.sum())  # a rattler may hang on one bond
    law = jamlab.ContactDamping(beta=1.0)
    flow = jamlab.oscillate(p, omega=0.1, amplitude=1e-6, damping=law)
    s = jamlab.complex_modulus(p, [0.1], damping=law)
    np.testing.assert_allclose([flow.storage, flow.loss], [s.storage[0], s.loss[0]], rtol=2e-3)


def test_network_of_slack_bonds_is_floppy():
    p = jamlab.pack(128, phi=0.5, seed=1, law={"stickiness": 0.1})
    assert p.converged and jamlab.contacts(p).z < 4 and abs(jamlab.evaluate(p).pressure) < 1e-10
    assert abs(jamlab.shear_modulus(p, direction="simple")) < 1e-6 and jamlab.maxwell_count(p).floppy_modes > 0
    jammed = jamlab.pack(128, phi=0.72, seed=1, law={"stickiness": 0.1})
    some = jammed.select(np.arange(128) % 2 == 0)
    assert some.law.range == pytest.approx(jammed.law.range, rel=1e-14)  # its own mean diameter is another one
    found = jamlab.complex_modulus(jammed, [1e-2, 1.0], method="direct")
    np.testing.assert_allclose(found.storage, jamlab.complex_modulus(jammed, [1e-2, 1.0]).storage, rtol=1e-8)
    assert jamlab.jam(8, "sp", 1, law={"stickiness": 0.0}).n == 8 == len(jamlab.pack(8, phi=0.7).positions)


REFUSED = {
    "jam": lambda: jamlab.jam(16, "sp", 1, law={"stickiness": 0.02}),
    "droplets": lambda: jamlab.jam(8, "dp", 1, law={"stickiness": 0.02}),
    "decompress": lambda: decompress(jamlab.pack(16, 1e-3, 1, law={"stickiness": 0.02}), 1e-4),
    "exponent": lambda: jamlab.pack(16, 1e-3, 1, law={"stickiness": 0.02, "exponent": 2.5}),
    "negative": lambda: jamlab.pack(16, 1e-3, 1, law={"stickiness": -0.02}),
    "nan": lambda: jamlab.pack(16, 1e-3, 1, law={"stickiness": np.nan}),
    "too wide": lambda: jamlab.pack(16, 1e-3, 1, law={"stickiness": 0.7}),
    "collapse": lambda: jamlab.pack(16, 1e-3, 1, law={"stickiness": 0.21}),
    "through each other": lambda: jamlab.pack(16, 0.11, 1, law={"stickiness": 0.2}),
    "text": lambda: jamlab.pack(16, 1e-3, 1, law={"stickiness": "weak"}),
    "tension": lambda: jamlab.pack(16, -0.5, 1, law={"stickiness": 0.02}),
    "repulsion under tension": lambda: jamlab.pack(16, -1e-3, 1),
    "both": lambda: jamlab.pack(16, 1e-3, phi=0.8),
    "neither": lambda: jamlab.pack(16),
    "no fraction": lambda: jamlab.pack(16, phi=-0.8, law={"stickiness": 0.02}),
}
VALUES = {"exponent": "2.5", "negative": "-0.02", "too wide": "0.7", "text": "weak", "tension": "-0.5"}
VALUES |= {"repulsion under tension": "-0.001", "no fraction": "-0.8", "both": "0.8", "decompress": "0.02"}
VALUES |= {"collapse": "from 1e-09 to 0.2; beyond, disks", "through each other": "from -0.3 to 0.1 for"}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_the_value(name):
    with pytest.raises(jamlab.InputError) as caught:
        REFUSED[name]()
    assert VALUES.get(name, "") in str(caught.value)


def test_tension_beyond_strength_is_no_packing():
    with pytest.raises(jamlab.ConvergenceError) as caught:
        jamlab.pack(32, -0.1, 1, law={"stickiness": 0.02})
    assert "-0.1" in str(caught.value)


def test_decks_know_the_law(tmp_path):
    p = wide(stickiness=0.05)
    jamlab.write(tmp_path / "wide.data", p)
    run("in.sp.minimize", tmp_path, data="wide.data", force_tolerance=1e-12)
    reached, relaxed = jamlab.read(tmp_path / "sp.minimum.data"), jamlab.relax(p)
    assert reached.params == p.params | {"exponent": 2.0} and jamlab.evaluate(reached).max_force < 2e-12
    assert jamlab.evaluate(reached).energy == pytest.approx(jamlab.evaluate(relaxed).energy, rel=1e-9)
    said = run("in.sp.contacts", tmp_path, data="sp.minimum.data", least=2)
    assert number("z", said) == pytest.approx(jamlab.contacts(reached).z, rel=1e-12)
    run("in.sp.jam", tmp_path, code=1, law=False, stickiness=0.1)


def test_disks_side_by_side_have_the_least_energy_up_to_the_largest_stickiness():
    """The integral of the pair energy over the plane is positive there, and negative beyond 0.23: packings collapse."""
    r = np.linspace(0, 2, 20_001)
    integrals = {}
    for stickiness in (0.2, 0.23, 0.24):
        energy, _, _ = StickyLaw("k", 1.0, stickiness, stickiness)(np.ones_like(r), r)
        integrals[stickiness] = np.trapezoid(np.where(r < 1 + 2 * stickiness, energy, 0.0) * r, r)
    assert integrals[0.2] > 0.01 > integrals[0.23] > 0 > integrals[0.24]
    assert StickyLaw.parameters["stickiness"].largest == 0.2


@pytest.mark.parametrize("pressure", [0.1, 1e-2, -1e-2])
def test_the_stickiest_disks_can_be_packed(pressure):
    """Of all signs of pressure, and disks do not lie upon each other."""
    packed = jamlab.pack(32, pressure, 1, law={"stickiness": 0.2})
    assert packed.converged and jamlab.evaluate(packed).pressure == pytest.approx(pressure, rel=1e-6)
    assert packed.phi < 1.2 and jamlab.contacts(packed).forces.gap.min() > -0.5


def test_a_pressure_that_is_not_reached_names_what_helps_sticky_disks():
    with pytest.raises(jamlab.ConvergenceError) as caught:
        jamlab.pack(16, -0.3, 1, law={"stickiness": 0.2})
    assert "nearer to 0" in str(caught.value) and "decompress" not in str(caught.value)
