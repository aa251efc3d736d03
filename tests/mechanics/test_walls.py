"""Fixed particles and walls: statics, response, files and quasi-static shear against what a periodic packing says."""

from pathlib import Path

import numpy as np
import pytest

import jamlab
from jamlab.figures.explorer.states import pack_state
from jamlab.flow.velocity_profile import velocity_profile
from jamlab.geometry.vertex_contacts import touching_disks
from jamlab.geometry.walls import wall_stress
from jamlab.mechanics.stiffness import forces, stress
from jamlab.packing.deformation import at_phi, deformed, sheared
from jamlab.packing.packing_plot import rings


@pytest.fixture(scope="module")
def packing():
    return jamlab.pack(n=64, pressure=1e-2, seed=1)


@pytest.fixture(scope="module")
def flat(packing):
    """64 disks between two flat walls."""
    return jamlab.relax(jamlab.with_walls(packing, flat=True))


@pytest.fixture(scope="module")
def flat_dp():
    few = jamlab.read(Path(__file__).parents[1] / "states" / "few_droplets.h5")
    return jamlab.relax(jamlab.with_walls(few, flat=True), 1e-12)


@pytest.fixture(scope="module")
def flat_sticky():
    return jamlab.relax(
        jamlab.with_walls(jamlab.pack(n=64, pressure=1e-2, seed=2, law={"stickiness": 0.02}), flat=True)
    )


@pytest.fixture(scope="module", params=["sp", "flat", "dp", "flat_dp", "flat_sticky"])
def walled(request, packing):
    if request.param == "sp":
        return jamlab.with_walls(packing)
    if request.param.startswith("flat"):
        return request.getfixturevalue(request.param)
    return jamlab.relax(jamlab.with_walls(request.getfixturevalue("dp_dense"), 1.2), 1e-12)


def test_a_mask_of_nothing_changes_no_digit(packing):
    same = packing.with_state(fixed=np.zeros(packing.n, dtype=bool))
    assert same.fixed is None and same.difference(packing) is None
    moved = [p.with_state(positions=p.positions + 1e-3 * np.sin(p.positions)) for p in (packing, same)]
    one, two = (jamlab.relax(p) for p in moved)
    assert np.array_equal(one.positions, two.positions)
    assert np.array_equal(*(jamlab.complex_modulus(p, [1e-2, 1.0]).loss for p in (one, two)))
    assert np.array_equal(*(jamlab.quasistatic_shear(p, 2e-3, 1e-3).stress for p in (one, two)))


def test_walls_of_a_minimum_are_at_a_minimum_and_stay(walled):
    """Both in LAMMPS and in plain sums; free particles come back to where they were pushed from."""
    found = jamlab.evaluate(walled)
    free = walled.frame.free_sites
    assert np.array_equal(found.forces[~free], np.zeros((np.sum(~free), 2))) and not forces(walled)[~free].any()
    assert found.stress == pytest.approx(stress(walled), abs=1e-12)
    pushed = walled.positions + 1e-5 * np.sin(7 * walled.positions) * free[:, None]
    back = jamlab.relax(walled.with_state(positions=pushed))
    assert back.converged and np.abs(back.positions - walled.positions)[~free].max() < 1e-14
    assert jamlab.evaluate(back).energy == pytest.approx(found.energy, rel=1e-11)


def test_stress_is_what_moving_the_wall_costs(walled):
    """By the energy of LAMMPS; and it is the push of the slab on either wall, to 1e-12 of the stiffness."""
    on_walls = wall_stress(walled)
    for k, gradient in enumerate(([[0, 1], [0, 0]], [[0, 0], [0, 1]])):
        step = 1e-6 * np.array(gradient)
        up, down = (jamlab.evaluate(deformed(walled, np.eye(2) + s * step)[0]).energy for s in (1, -1))
        slope = (up - down) / 2e-6 / walled.area
        assert slope == pytest.approx(-np.sum(jamlab.evaluate(walled).stress * gradient), rel=1e-6, abs=1e-9)
        assert slope == pytest.approx((1 - 2 * k) * on_walls[0, k], rel=1e-6, abs=1e-9)
    assert on_walls[0] == pytest.approx(on_walls[1], abs=1e-12)
    assert jamlab.evaluate(walled).pressure == pytest.approx(on_walls[0, 1], abs=1e-12)


def test_moduli_by_strain_are_those_of_linear_response(walled):
    exact = jamlab.shear_modulus(walled, direction="simple")
    if walled.flat_walls.any():
        assert exact == pytest.approx(0.0, abs=1e-12)  # the slab slips
    else:
        assert jamlab.shear_modulus(walled, "finite-strain", direction="simple") == pytest.approx(exact, rel=1e-5)
    assert jamlab.bulk_modulus(walled, "finite-strain") == pytest.approx(jamlab.bulk_modulus(walled), rel=1e-6)


def test_fixed_particles_leave_no_translations(walled):
    network, free = jamlab.contacts(walled), ~walled.fixed
    modes = jamlab.lowest_modes(walled, 6)
    slips = int(walled.flat_walls.any())
    loose = slips + (2 * int(network.rattlers.sum()) if walled.model == "sp" else 0)
    assert not modes.vectors[:, walled.frame.fixed_sites].any() and jamlab.count_zero_modes(walled) == loose
    assert modes.eigenvalues[min(loose, 5)] > 1e-9
    assert not network.rattlers[walled.fixed].any() and network.n_backbone == np.sum(free & ~network.rattlers)
    bearing = network.pairs[network.bearing]
    assert free[bearing].any(axis=1).all() and network.z == free[bearing].sum() / network.n_backbone
    count = jamlab.maxwell_count(walled)
    motions = walled.kind.motions * count.n_particles
    assert (
        count.n_particles == network.n_backbone
        and count.contacts == motions - count.floppy_modes + count.self_stress_states
    )
    assert network.isostatic == 2 * network.n_backbone + 1 - slips


DAMPINGS = [jamlab.ContactDamping(), jamlab.ContactDamping(beta=0.0), jamlab.StokesDrag(eta_f=1.0)]
SLABS = [("rough", 0), ("rough", 1), ("rough", 2), ("flat", 0), ("flat", 2), ("flat_dp", 1), ("flat_sticky", 1)]


@pytest.mark.parametrize(
    ("made", "damping"),
    [
        pytest.param(made, damping, marks=[pytest.mark.slow] * ((made, k) not in SLABS))
        for made in ("rough", "flat", "flat_dp", "flat_sticky")
        for k, damping in enumerate(DAMPINGS)
    ],
)
def test_complex_modulus_of_a_slab_is_that_of_dense_solves(request, packing, damping, made):
    """Of the matrices of the periodic packing, with the motion of the rigid walls written out here."""
    smooth = made != "rough"
    walled = request.getfixturevalue(made) if smooth else jamlab.with_walls(packing)
    packing = walled if smooth else packing
    n, fixed = len(packing.positions), walled.frame.fixed_sites
    k, b = (m.toarray() for m in jamlab.dynamical_matrices(packing, damping))
    if not damping.at_contacts:  # the fluid drags on free particles alone
        b[np.repeat(fixed, 2).nonzero()[0]] *= 0
    height, y = packing.box[1, 1], packing.positions[:, 1]
    plane = np.where(y % height > height / 2, height, 0.0) + np.floor(y / height) * height
    free = np.flatnonzero(~fixed & ~jamlab.contacts(walled).rattlers[walled.particle])
    turning = 2 * n + free if packing.model == "sp" and damping.at_contacts and damping.contrast else free[:0]
    columns = np.concatenate([2 * free, 2 * free + 1, turning])
    motion = np.zeros((len(k), len(columns) + 1))
    motion[columns, np.arange(len(columns))] = motion[-1, -1] = 1.0
    motion[2 * np.flatnonzero(fixed), -1] = (plane - y)[fixed]
    omega = np.geomspace(1e-4, 1e2, 5)
    expected = []
    for w in omega:
        m = motion.T @ (k + 1j * w * b) @ motion
        expected.append((m[-1, -1] - m[-1, :-1] @ np.linalg.solve(m[:-1, :-1], m[:-1, -1])) / packing.area)
    if smooth and damping.at_contacts and not damping.contrast:  # nothing drags along flat walls
        assert np.abs(expected).max() < 1e-12
        with pytest.raises(jamlab.InputError):
            jamlab.complex_modulus(walled, omega, damping)
        return
    for method in ("direct", "dense", "reduced"):
        found = jamlab.complex_modulus(walled, omega, damping, method=method)
        rel = 1e-8 if walled.law.range else 1e-9  # sticky disks have a trace of drag more
        small = rel * np.abs(expected).max() if walled.model == "dp" else 1e-14  # hardly lose anything at once
        assert found.storage == pytest.approx(np.real(expected), rel=rel, abs=small)
        assert found.loss == pytest.approx(np.imag(expected), rel=rel, abs=small)


def pressed(height, params):
    """One disk of diameter 1 between flat walls at 1 and `height` - 1, and its overlap with each."""
    x, walls = [[0.3, height / 2 + 0.01], [0.0, 1.0], [0.7, height - 1.0]], np.array([False, True, True])
    p = jamlab.Packing(
        "sp", np.diag([3.0, height]), x, params, next(iter(params)), [1.0, 0, 0], fixed=walls, walls=True
    )
    overlap = 0.5 - np.array([x[0][1] - 1.0, height - 1.0 - x[0][1]])
    return p, overlap


@pytest.mark.parametrize(("params", "k"), [({"k": 2.0}, 2.0), ({"eps": 2.0}, 8.0), ({"k": 2.0, "exponent": 2.5}, None)])
def test_one_disk_between_flat_walls(params, k):
    """By hand: two springs, at half a diameter; along x nothing acts."""
    p, overlap = pressed(2.9, params)
    alpha = params.get("exponent", 2.0)
    stiffness = k or 2.0 * (2 * overlap) ** (alpha - 2)  # k s^2/alpha (overlap/s)^alpha, s = 1/2
    found = jamlab.evaluate(p)
    assert found.energy == pytest.approx(np.sum(stiffness * overlap**2) / alpha, rel=1e-13)
    force = stiffness * overlap * [1, -1]
    assert found.forces[0] == pytest.approx([0.0, force.sum()], abs=1e-14)
    assert wall_stress(p) == pytest.approx(np.column_stack([[0, 0], np.abs(force) / 3.0]), abs=1e-14)
    assert jamlab.hessian(p).toarray()[:2, :2] == pytest.approx(
        np.diag([0.0, np.sum((alpha - 1) * stiffness * np.ones(2))]), abs=1e-13
    )
    middle = jamlab.relax(p)
    assert middle.positions[0] == pytest.approx([0.3, 1.45], abs=1e-11)
    bare = jamlab.slab(p)
    cut = sum(2 * np.trapezoid(np.sqrt(0.25 - y**2), y) for y in (np.linspace(0.5 - o, 0.5, 20001) for o in overlap))
    assert bare.packing_fraction == pytest.approx((np.pi / 4 - cut) / (3 * 0.9), abs=1e-7)


@pytest.mark.parametrize("many", [False, True])
def test_flat_walls_push_by_the_slope_of_the_energy(packing, flat, many):
    """Forces and Hessian by differences, in LAMMPS and in numpy, also where each disk has its own size; no force
    depends on x, nor on the image of a disk."""
    p = flat
    if many:  # more sizes than types of LAMMPS
        own = np.append(flat.diameters[:-2] * (1 + 0.01 * np.sin(np.arange(64))), [0, 0])
        p = flat.with_state(diameters=own, params={"eps": 1.0, "exponent": 2.5}, units="eps")
    p = p.with_state(positions=p.positions + 0.02 * np.sin(7 * p.positions) * p.frame.free_sites[:, None])
    push, h = jamlab.evaluate(p).forces, jamlab.hessian(p).toarray()
    assert push == pytest.approx(forces(p), abs=1e-13)
    near = np.unique(touching_disks(p).i[p.flat_walls[touching_disks(p).j]])
    assert len(near) > 6
    for k in (2 * near[0], 2 * near[0] + 1, 2 * near[-1] + 1):
        step = np.zeros(2 * p.n)
        step[k] = 1e-6
        up, down = (p.with_state(positions=p.positions + s * step.reshape(-1, 2)) for s in (1, -1))
        slope = (jamlab.evaluate(up).energy - jamlab.evaluate(down).energy) / 2e-6
        assert push.ravel()[k] == pytest.approx(-slope, abs=1e-8)
        assert h[k] == pytest.approx(-(forces(up) - forces(down)).ravel() / 2e-6, abs=1e-7 if not many else 1e-5)
    shift = np.arange(p.n)[:, None] % 3 * p.box[1] + [0.37, 0.0]
    moved = p.with_state(positions=p.positions + np.where(p.frame.fixed_sites[:, None], [-0.2, 0.0], shift))
    assert jamlab.evaluate(moved).forces == pytest.approx(push, abs=1e-12)
    assert forces(moved) == pytest.approx(push, abs=1e-12) and stress(moved) == pytest.approx(stress(p), abs=1e-12)


def test_droplets_press_on_flat_walls_by_the_height_of_their_vertices(flat_dp):
    """Energy by a plain sum, forces and Hessian by its differences; the slab slips."""
    x = flat_dp.positions + 1e-3 * np.sin(7 * flat_dp.positions) * flat_dp.frame.free_sites[:, None]
    p, (low, high), delta = flat_dp.with_state(positions=x), flat_dp.positions[-2:, 1], flat_dp.params["delta"]
    gaps = np.maximum(0, 1 - np.array([x[:-2, 1] - low, high - x[:-2, 1]]) / delta)
    push, alone = jamlab.evaluate(p), jamlab.evaluate(p.select(~p.flat_walls))
    assert push.energy == pytest.approx(alone.energy + 0.5 * p.params["eps"] * np.sum(gaps**2), rel=1e-12)
    assert push.forces == pytest.approx(forces(p), abs=1e-11)
    h, met = jamlab.hessian(p), np.flatnonzero(gaps.sum(axis=0))
    for k in (2 * met[0], 2 * met[0] + 1, 2 * met[-1] + 1):
        step = np.zeros(2 * len(x))
        step[k] = 1e-7
        up, down = (p.with_state(positions=x + s * step.reshape(-1, 2)) for s in (1, -1))
        assert push.forces.ravel()[k] == pytest.approx(
            -(jamlab.evaluate(up).energy - jamlab.evaluate(down).energy) / 2e-7, abs=1e-6
        )
        assert h[[k]].toarray()[0] == pytest.approx(-(forces(up) - forces(down)).ravel() / 2e-7, rel=1e-5, abs=1e-4)
    moved = p.with_state(positions=x + [0.31, 0.0] * p.frame.free_sites[:, None])
    assert jamlab.evaluate(moved).energy == pytest.approx(push.energy, rel=1e-13)


@pytest.mark.parametrize("made", ["flat", "flat_dp", "flat_sticky"])
def test_cells_voids_and_fractions_end_at_flat_walls(request, made):
    p = request.getfixturevalue(made)
    (low, high), width, rho = p.frame.planes, p.box[0, 0], jamlab.packing_fraction(p)
    slab, found, cells = width * (high - low), jamlab.voids(p), jamlab.tessellation(p)
    assert cells.area.sum() == pytest.approx(slab, rel=1e-12) and not cells.area[-2:].any()
    assert found.area.sum() == pytest.approx((1 - rho) * slab, rel=1e-9)
    assert jamlab.particle_areas(p).sum() == pytest.approx(rho * slab, rel=1e-6)
    rim = 0.5 * (p.diameters[:-2] if p.model == "sp" else p.params["delta"])
    y = p.positions[p.frame.free_sites, 1]
    assert [(y - rim).min(), (y + rim).max()] == pytest.approx([low, high], abs=0.05)  # they press on the walls
    y = found.centroid[found.percolating == 0, 1] % p.box[1, 1]
    assert ((low < y) & (y < high)).all() and jamlab.slab(p).packing_fraction == rho
    if p.model == "sp":  # by points on a grid
        x, y = np.meshgrid((np.arange(300) + 0.5) / 300 * width, low + (np.arange(300) + 0.5) / 300 * (high - low))
        r = np.stack([x, y], axis=-1)[..., None, :] - p.positions[:-2]
        r -= np.round(r @ np.linalg.inv(p.box)) @ p.box
        covered = (np.hypot(*np.moveaxis(r, -1, 0)) < 0.5 * p.diameters[:-2]).any(axis=-1)
        assert covered.mean() == pytest.approx(rho, abs=3e-3)
    assert pack_state(p, None)["planes"] == p.frame.planes and len(rings(p)[0]) == p.n


def test_oscillation_between_walls_is_that_of_linear_response(walled):
    found, expected = jamlab.oscillate(walled, 1.0, 1e-6, cycles=3), jamlab.complex_modulus(walled, [1.0])
    assert complex(found.storage, found.loss) == pytest.approx(complex(*expected.storage, *expected.loss), rel=3e-3)
    off = (found.packing.positions - walled.positions)[walled.frame.fixed_sites]
    assert np.abs(off).max() < 1e-12  # after whole cycles


def test_walls_shear_a_slab(packing):
    """The upper one moves as a whole; both bear the same stress, whose work is the change of energy."""
    walled = jamlab.with_walls(packing)
    slope = jamlab.quasistatic_shear(walled, 1e-6, 5e-7)
    assert np.diff(slope.stress) / 5e-7 == pytest.approx(jamlab.shear_modulus(walled, direction="simple"), rel=1e-5)
    found = jamlab.quasistatic_shear(walled, 0.05, 5e-3, walls=True, snapshot_every=0.01)
    assert found.converged.all() and found.wall_stress.shape == (11, 2, 2)
    assert found.wall_stress[:, 0] == pytest.approx(found.wall_stress[:, 1], abs=1e-11)
    assert found.wall_stress[:, 0] == pytest.approx(np.column_stack([found.stress, found.pressure]), abs=1e-11)
    moved, height = (found.packing.positions - walled.positions)[walled.fixed], walled.box[1, 1]
    image, inside = np.divmod(walled.positions[walled.fixed, 1], height)
    assert moved[:, 0] - 0.05 * height * image == pytest.approx(0.05 * height * (inside > height / 2), abs=1e-12)
    assert np.abs(moved[:, 1]).max() < 1e-12
    profile, between = found.velocity_profile, jamlab.slab(walled)
    assert np.all(profile.height > between.bottom / walled.box[1, 1] - 0.1)
    assert profile.localisation > 1 and 0 < profile.velocity[0] < profile.velocity[-1] < 1
    assert 0.8 < between.packing_fraction < 0.95 and 0 < between.voids.sum() < len(between.voids)
    bare, plain = (jamlab.quasistatic_shear(p, 1e-3, 1e-3, walls=False) for p in (walled, packing))
    assert not len(bare.wall_stress) and np.array_equal(bare.stress, plain.stress)


def test_shear_at_constant_pressure_on_the_walls(packing):
    """The enthalpy is least over the height, at constant width."""
    walled = jamlab.with_walls(packing)
    found = jamlab.quasistatic_shear(walled, 0.02, 0.01, pressure="constant")
    end, held = found.packing, found.held_pressure
    assert found.wall_stress[:, :, 1] == pytest.approx(held, rel=1e-9) and end.box[0, 0] == walled.box[0, 0]
    assert end.box[1, 1] > walled.box[1, 1]  # it dilates
    beside = [jamlab.relax(at_phi(end, end.phi * (1 + s))) for s in (-1e-4, 1e-4)]
    enthalpy = [jamlab.evaluate(p).energy + held * p.area for p in (end, *beside)]
    assert enthalpy[0] < min(enthalpy[1:])


def test_fixed_droplets_are_not_squeezed(dp_dense):
    """Compression moves them; the pressure of the strained packing is -dU/dA of `compress`, in flow as well."""
    mask = np.arange(dp_dense.n) % 4 == 1
    pinned = dp_dense.with_state(fixed=mask, converged=True, max_force=dp_dense.max_force)
    flow = jamlab.shear(pinned, 1e-3, 0.02, rows=1, tolerance=1e-3)
    assert flow.pressure[-1] == pytest.approx(jamlab.evaluate(flow.packing).pressure, rel=2e-3)
    bent = jamlab.relax(sheared(pinned, 0.02), 1e-12)
    (up,) = jamlab.compress(bent, to=bent.phi * (1 + 1e-6), step=1e-6, by="phi", force_tolerance=1e-12)
    assert up.polygons.areas[mask] == pytest.approx(bent.polygons.areas[mask], rel=1e-13)
    one, two = jamlab.evaluate(bent), jamlab.evaluate(up)
    assert (two.energy - one.energy) / (bent.area - up.area) == pytest.approx(one.pressure, rel=1e-4)


@pytest.mark.parametrize("damping", [jamlab.ContactDamping(), jamlab.StokesDrag(eta_f=0.5)])
def test_flow_in_time_between_walls(walled, damping, tmp_path):
    """Begins with the viscosity of G* at infinite frequency; the walls keep their shape, and energy is balanced."""
    file = tmp_path / "flow.h5"
    how = {
        "rows": 6,
        "snapshot_every": 0.01,
        "background_drag": 0.0 if damping.at_contacts else None,
        "tolerance": 1e-3,
    }
    part = jamlab.shear(walled, 0.1, 0.02, damping, walls=True, path=file, **how)
    found = jamlab.shear(walled, 0.1, 0.02, damping, path=file, **how)
    assert np.array_equal(found.wall_stress, part.wall_stress) and found.energy_error < 1e-2
    viscosity = jamlab.complex_modulus(walled, 1.0, damping).eta_inf
    assert found.viscous_stress[0] == pytest.approx(0.1 * viscosity, rel=1e-4, abs=1e-9)
    moved, height = (found.packing.positions - walled.positions)[walled.frame.fixed_sites], walled.box[1, 1]
    plane = np.round(walled.centroids[walled.particle[walled.frame.fixed_sites], 1] / height)
    assert moved[:, 0] == pytest.approx(0.02 * height * plane, abs=1e-12)
    assert np.abs(moved[:, 1]).max() < 1e-12
    if damping.at_contacts:  # nothing but the walls pushes the slab
        on_walls = np.column_stack([found.stress, found.pressure])
        assert found.wall_stress[:, 0] == pytest.approx(found.wall_stress[:, 1], rel=1e-4, abs=1e-8)
        assert found.wall_stress[:, 1] == pytest.approx(on_walls, rel=1e-4, abs=1e-8)
    assert found.velocity_profile.velocity[0] < found.velocity_profile.velocity[-1]


@pytest.mark.parametrize(
    "made", ["rough", *(pytest.param(each, marks=pytest.mark.slow) for each in ("dp_dense", "flat", "flat_dp"))]
)
def test_creep_between_walls(request, packing, made, tmp_path):
    """A weak stress ends at the strain of the modulus; between flat walls nothing holds the slab, which flows. Both
    walls bear the stress throughout. A file goes on."""
    walled = jamlab.with_walls(packing) if made == "rough" else request.getfixturevalue(made)
    if made == "dp_dense":
        walled = jamlab.relax(jamlab.with_walls(walled, 1.2), 1e-12)
    at_rest, stress, file = wall_stress(walled)[:, 0], 1e-6 * jamlab.evaluate(walled).pressure, tmp_path / "creep.h5"
    jamlab.creep(walled, stress, 1.0, path=file)
    crept = jamlab.creep(walled, stress, 1e4, path=file)
    assert crept.time[-1] == pytest.approx(1e4) and crept.energy_error < 1e-2
    assert (crept.wall_stress[1:, :, 0] - at_rest) / stress == pytest.approx(
        np.ones((len(crept.time) - 1, 2)), abs=1e-3
    )
    if made.startswith("flat"):
        assert crept.state != "rests" and crept.slope > 0.9
    else:
        assert crept.state == "rests"
        assert 1 / crept.compliance[-1] == pytest.approx(jamlab.shear_modulus(walled, direction="simple"), rel=1e-3)


@pytest.mark.slow
def test_droplets_with_fixed_ones_answer_in_time_as_in_linear_response(dp_dense):
    walled, small = jamlab.with_walls(dp_dense, 1.2), 1e-6
    relaxing = jamlab.relax_stress(walled, small, 1e5)
    assert relaxing.modulus[-1] == pytest.approx(jamlab.shear_modulus(walled, direction="simple"), rel=1e-3)
    mask = np.arange(dp_dense.n) % 5 == 0
    pinned = dp_dense.with_state(fixed=mask, converged=True, max_force=dp_dense.max_force)
    expected = jamlab.complex_modulus(pinned, [1.0])
    found = jamlab.oscillate(pinned, 1.0, small, cycles=3)
    assert complex(found.storage, found.loss) == pytest.approx(complex(*expected.storage, *expected.loss), rel=1e-3)
    crept = jamlab.creep(pinned, small * expected.g0, 1e5)
    assert 1 / crept.compliance[-1] == pytest.approx(expected.g0, rel=1e-3)
    off = crept.packing.positions - sheared(pinned, crept.strain[-1]).positions
    assert np.abs(off[pinned.frame.fixed_sites]).max() < 1e-12


def test_scattered_fixed_disks_follow_the_flow(packing):
    mask = np.arange(packing.n) % 7 == 0
    found = jamlab.shear(packing.with_state(fixed=mask), 0.1, 0.01, rows=2, background_drag=0.0)
    assert found.packing.positions[mask] == pytest.approx(sheared(packing, 0.01).positions[mask], abs=1e-12)
    assert found.energy_error < 1e-2 and not len(found.wall_stress)


def test_profile_of_an_affine_flow_is_straight():
    """A crystal: every layer moves with the box, walls or not, across the periodic edge as well."""
    i, j = np.divmod(np.arange(48), 6)
    x = 0.9 * np.column_stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j + 0.1])
    p = jamlab.Packing("sp", 0.9 * np.diag([8, 6 * np.sqrt(0.75)]), x, {"k": 1.0}, "k", np.ones(48))
    profile = jamlab.quasistatic_shear(p, 0.02, 0.01).velocity_profile
    assert profile.velocity == pytest.approx(profile.height, abs=1e-9) and len(profile.height) == 5
    assert profile.localisation == pytest.approx(1.0) and profile.standard_error.shape == (5,)


def test_a_velocity_profile_is_the_affine_one_and_what_the_parts_add(packing):
    """Frames that are sheared by hand and pushed along x by different parts of the strain; cells of the lattice above
    and below are no matter."""
    frames, moved = [], 0.0
    for strain, push in zip((0.0, 0.01, 0.03, 0.04), (0.0, 0.3, 0.0, -0.3), strict=True):
        moved += push * 0.01 * packing.box[1, 1]
        state = sheared(packing, strain)
        along = np.arange(packing.n)[:, None] % 3 * state.box[1] + np.array([moved, 0.0])
        frames.append(state.with_state(positions=state.positions + along, provenance={"flow_strain": strain}))
    found = velocity_profile(frames)
    assert found.velocity == pytest.approx(found.height, abs=1e-12) and found.height.max() < 1
    assert found.standard_error == pytest.approx(np.full(len(found.height), 0.3 / np.sqrt(3)))


@pytest.mark.parametrize("ending", ["h5", "data", "dump"])
def test_files_keep_walls(walled, tmp_path, ending):
    file = tmp_path / f"walled.{ending}"
    for given in (walled,) if walled.flat_walls.any() else (walled, walled.with_state(walls=False)):
        jamlab.write(file, [given] if ending == "dump" else given)
        found = jamlab.read(file)
        assert found.difference(given) is None and found.walls is given.walls
    assert jamlab.from_universe(jamlab.universe(walled))[0].difference(walled) is None
    assert walled.select(~walled.fixed).fixed is None and walled.select(walled.fixed | True).walls


def test_droplets_made_from_walled_disks_keep_the_walls():
    *_, disks = jamlab.compress(jamlab.jam(24, seed=1), to=0.87, step=0.02)
    walled = jamlab.with_walls(disks, 1.3)
    found = jamlab.droplets_from_disks(walled)
    assert found.walls and np.array_equal(found.fixed, walled.fixed)
    assert wall_stress(found)[0] == pytest.approx(wall_stress(found)[1], abs=1e-9)


def test_scattered_fixed_particles_follow_the_box(packing):
    """Their response is 0, and that of the others balances forces."""
    mask = np.arange(packing.n) % 7 == 0
    pinned = packing.with_state(fixed=mask, converged=True, max_force=packing.max_force)
    tensor = jamlab.elastic_tensor(pinned)
    assert not tensor.displacements[mask].any() and jamlab.shear_modulus(pinned) > jamlab.shear_modulus(packing)
    strained = sheared(pinned, 1e-5)
    relaxed = jamlab.relax(strained)
    assert relaxed.positions[mask] == pytest.approx(strained.positions[mask], abs=1e-14)
    response = (relaxed.positions - strained.positions) / 1e-5
    held = ~jamlab.contacts(pinned).rattlers
    assert response[held] == pytest.approx(tensor.displacements[held, :, 0, 1], abs=2e-3)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda p, w: p.with_state(fixed=np.ones(p.n, dtype=bool)), "64"),
        (lambda p, w: p.with_state(fixed=np.zeros(3, dtype=bool)), "(3,)"),
        (lambda p, w: p.with_state(fixed=np.zeros(p.n)), "array([0."),
        (lambda p, w: p.with_state(walls=True), "walls=True"),
        (lambda p, w: jamlab.with_walls(p, 0.0), "0"),
        (lambda p, w: jamlab.with_walls(p, np.nan), "nan"),
        (lambda p, w: jamlab.with_walls(p, 4.0), "4"),
        (lambda p, w: jamlab.with_walls(p, 1.0), "1.0"),  # thinner than the largest disk
        (lambda p, w: jamlab.with_walls(jamlab.pack(4, 1e-2)), "flat=True"),  # too low a box
        (lambda p, w: jamlab.with_walls(w, flat=True), "fixed"),
        (lambda p, w: jamlab.with_walls(jamlab.with_walls(p, 2.5), 1.5), "lie between the walls"),
        (lambda p, w: jamlab.with_walls(p.with_state(fixed=np.arange(p.n) % 3 == 0)), "lie between the walls"),
        (lambda p, w: jamlab.shear(_flat(p), 0.1, 0.01, walls=False), "packing.select(~packing.flat_walls)"),
        (lambda p, w: jamlab.droplets_from_disks(jamlab.with_walls(p, flat=True)), "flat=True"),
        (lambda p, w: p.with_state(diameters=p.diameters * (np.arange(p.n) > 0)), "diameters[0]"),
        (lambda p, w: jamlab.evaluate(_behind_a_flat_wall(p)), "particle 3"),
        (lambda p, w: jamlab.shear(_flat(p), 0.1, 0.01, jamlab.ContactDamping(beta=0.0), background_drag=0.0), "beta"),
        (lambda p, w: jamlab.Session(_flat(p), ranks=2), "ranks = 2"),
        (lambda p, w: jamlab.quasistatic_shear(p, 0.01, walls=True), "walls=True"),
        (lambda p, w: jamlab.quasistatic_shear(w, 0.01, direction="pure"), "'pure'"),
        (lambda p, w: jamlab.quasistatic_shear(w, 0.01, direction=0.3), "0.3"),
        (lambda p, w: jamlab.shear_modulus(w), "mean over directions"),
        (lambda p, w: jamlab.elastic_tensor(w), "elastic tensor"),
        (lambda p, w: jamlab.complex_modulus(w, 1.0, direction="pure"), "'pure'"),
        (lambda p, w: w.with_state(ensemble="shear-stabilized"), "walls keep their shape"),
        (lambda p, w: jamlab.Session(w, ranks=2), "ranks = 2"),
        (lambda p, w: jamlab.slab(p), "walls=True"),
        (lambda p, w: jamlab.shear(p, 0.1, 0.01, walls=True), "walls=True"),
        (lambda p, w: jamlab.creep(w, 0.0, 1.0), "stress"),
        (lambda p, w: jamlab.quasistatic_shear(p, 0.01, 0.01).frames[0] and velocity_profile([p]), "1"),
    ],
)
def test_bad_input_is_refused(packing, call, named):
    with pytest.raises(jamlab.InputError) as caught:
        call(packing, jamlab.with_walls(packing))
    assert named in str(caught.value)


def _flat(packing):
    return jamlab.with_walls(packing, flat=True)


def _behind_a_flat_wall(packing):
    walled = jamlab.with_walls(packing, flat=True)
    return walled.with_state(
        positions=walled.positions - np.outer(np.arange(walled.n) == 3, [0, walled.positions[3, 1]])
    )
