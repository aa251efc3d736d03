"""What holds a packing: answers that follow from the definition of a frame alone, of packings made by hand."""

import numpy as np
import pytest

import jamlab
from jamlab.packing.frame import FixedParticles, FlatWalls, Frame, RoughWalls, frame_of
from jamlab.packing.strain_map import ALONG_Y, SIMPLE_SHEAR
from jamlab.packing.terms import central_terms

SQUARE = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
PLACES = np.array([[1.0, 1.0], [1.5, 3.0], [1.0, 5.0], [2.5, 3.2]])
BOX = np.array([[4.0, 0.0], [0.5, 6.0]])
OUTER = np.array([True, False, True, False])  # the lowest and the highest of PLACES
DROPLETS = {"gamma": 0.1, "ka": 1.0, "eps": 1.0, "delta": 0.1, "eta": 1e-3, "contact": "outline"}
GENERAL = np.array([[1.1, 0.3], [-0.2, 0.9]])


def disks(**more):
    return jamlab.Packing("sp", BOX, PLACES, {"k": 1.0}, "k", [1.0, 0.8, 1.2, 0.6], **more)


def droplets(**more):
    positions = np.concatenate([place + 0.5 * SQUARE for place in PLACES])
    params = DROPLETS | {"a0": np.full(4, 0.25)}
    return jamlab.Packing("dp", BOX, positions, params, offsets=4 * np.arange(5), **more)


def between_lines(box=BOX):
    """Disks between two lines at y = 0.5 and 5.5, which lean with the box."""
    lines = np.array([[0.3, 0.5], [0.7, 5.5]])
    kept = np.array([0, 1, 3])
    sizes = [1.0, 0.8, 0.6, 0.0, 0.0]
    fixed = np.arange(5) > 2
    return jamlab.Packing(
        "sp", box, np.append(PLACES[kept], lines, axis=0), {"k": 1.0}, "k", sizes, fixed=fixed, walls=True
    )


CASES = {
    "periodic": (disks, {}, Frame),
    "fixed": (disks, {"fixed": OUTER}, FixedParticles),
    "fixed droplets": (droplets, {"fixed": OUTER}, FixedParticles),
    "rough": (disks, {"fixed": OUTER, "walls": True}, RoughWalls),
    "rough droplets": (droplets, {"fixed": OUTER, "walls": True}, RoughWalls),
    "flat": (between_lines, {}, FlatWalls),
}


@pytest.fixture(params=CASES)
def packing(request):
    make, more, frame = CASES[request.param]
    p = make(**more)
    assert type(p.frame) is frame is type(frame_of(p))
    return p


def test_every_particle_and_site_is_free_or_fixed(packing):
    frame = packing.frame
    assert (frame.fixed == ~frame.free).all() and frame.all_free == frame.free.all()
    assert (frame.fixed_sites == frame.fixed[packing.particle]).all() and (frame.free_sites == ~frame.fixed_sites).all()
    values = np.arange(1.0, 1.0 + 2 * len(packing.positions))
    held = frame.hold(values.copy(), 2)
    assert (held[np.repeat(frame.free_sites, 2)] == values[np.repeat(frame.free_sites, 2)]).all()
    assert not held[np.repeat(frame.fixed_sites, 2)].any()


def test_free_particles_may_move_together_where_the_energy_stays(packing):
    """Each direction of the box in which a push of all free particles leaves every distance to what is fixed."""
    frame = packing.frame
    still = 0
    for axis in range(2):
        moved = packing.positions + 1e-3 * np.outer(frame.free_sites, np.eye(2)[axis])
        for i in np.flatnonzero(frame.fixed_sites):
            r = np.delete(packing.positions, i, axis=0) - packing.positions[i]
            after = np.delete(moved, i, axis=0) - moved[i]
            if frame.flat_sites[i]:  # a line is met at the distance along y
                r, after = r[:, 1:], after[:, 1:]
            if not np.allclose(r, after):
                break
        else:
            still += 1
    assert frame.translations == still and frame.slips == (still == 1)


def test_drift_is_the_motion_of_the_whole_packing():
    u = np.array([[1.0, 2.0], [3.0, 6.0], [2.0, 1.0], [2.0, -1.0]])
    free, beside_fixed = disks(), disks(fixed=OUTER)
    assert (u - free.frame.drift(u) == u - [2.0, 2.0]).all() and (u - beside_fixed.frame.drift(u) == u).all()
    assert (free.frame.drift(u[None], axis=1) == [[[2.0, 2.0]]]).all()


def test_walls_admit_shear_along_them_and_compression_onto_them(packing):
    frame = packing.frame
    strains = {"shear": SIMPLE_SHEAR, "height": ALONG_Y, "width": np.diag([1.0, 0.0]), "up": SIMPLE_SHEAR.T}
    taken = {name for name, strain in strains.items() if frame.admits(strain)}
    assert taken == ({"shear", "height"} if frame.has_walls else {*strains})
    assert frame.admits([SIMPLE_SHEAR, 3 * ALONG_Y]) and frame.admits(frame.squeeze)
    assert frame.admits(np.eye(2)) is not frame.has_walls and np.trace(frame.squeeze) == 1.0
    flat = frame.strains.reshape(len(frame.strains), 4)
    assert np.allclose(flat @ flat.T, np.eye(len(flat)))  # orthonormal, as `admits` takes them
    if frame.has_walls:
        with pytest.raises(jamlab.InputError, match=r"swelling is not defined between walls.*walls=False"):
            frame.check_admitted(np.eye(2), "swelling")
    else:
        frame.check_admitted(np.eye(2), "swelling")


def test_strains_carry_sites_as_the_frame_says(packing):
    """Free sites affinely, fixed outlines with their area, walls as they are, at their lattice planes."""
    gradient = np.array([[1.0, 0.3], [0.0, 0.9]]) if packing.frame.has_walls else GENERAL
    frame, x = packing.frame, packing.positions
    moved = frame.carried(gradient)
    assert np.allclose(moved[frame.free_sites], x[frame.free_sites] @ gradient.T)
    for particle in np.flatnonzero(frame.fixed):
        own = packing.particle == particle
        centre = packing.centroids[particle]
        shape = x[own] - centre
        if frame.has_walls:
            height = 6.0 * round(centre[1] / 6.0)
            goal, after = centre + np.array([0.3, -0.1]) * height, shape
        else:
            goal, after = gradient @ centre, shape @ gradient.T / np.sqrt(np.linalg.det(gradient))
        assert np.allclose(moved[own], goal + after)
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    assert np.allclose(frame.carried(gradient, quarter), moved @ quarter.T)


def test_offsets_and_shapes_are_the_derivatives_of_the_map(packing):
    frame, step = packing.frame, 1e-6
    for strain in frame.strains:
        slope = (frame.carried(np.eye(2) + step * strain) - frame.carried(np.eye(2) - step * strain)) / (2 * step)
        linear = (packing.positions + frame.wall_offsets) @ strain.T - 0.5 * np.trace(strain) * frame.kept_shapes
        assert np.allclose(slope, linear, atol=1e-9)


def test_hessians_couple_free_sites_alone(packing):
    pairs = np.array([[0, len(packing.positions) - 1]])
    one, r = np.ones(1), np.array([[0.6, 0.8]])
    term = central_terms("spring", pairs, r, r, one, one, 3 * one, 2 * one)
    (after,) = packing.frame.between_free([term])
    free = packing.frame.free_sites[pairs[0]]
    for a in range(2):
        for b in range(2):
            kept = term.hessian[0, a, :, b] if free[a] and free[b] else np.zeros((2, 2))
            assert (after.hessian[0, a, :, b] == kept).all()
    assert after.gradient is term.gradient  # forces on fixed sites are what carries a wall


def test_what_has_no_flat_walls_is_its_own_image(packing):
    frame = packing.frame
    if frame.is_flat:
        return
    values = np.arange(4.0)
    assert frame.images is packing and frame.pull_back(values) is values
    assert frame.planes == (0.0, 6.0) and not frame.flat_sites.any() and len(frame.sizes) == packing.n


def test_images_behind_flat_walls_mirror_the_slab():
    p = between_lines()
    frame, images = p.frame, p.frame.images
    assert frame.planes == (0.5, 5.5) and frame.sizes.tolist() == [1.0, 0.8, 0.6] and frame.is_flat
    assert frame.flat_sites.tolist() == [False, False, False, True, True]
    assert images.frame.all_free and images.box.tolist() == [[4.0, 0.0], [0.0, 10.0]]
    assert images.diameters.tolist() == [1.0, 0.8, 0.6] * 2
    own, other = images.positions[:3], images.positions[3:]
    assert np.allclose(own, p.positions[:3] - [0.0, 0.5]) and np.allclose(other, own * [1.0, -1.0])
    values = frame.pull_back(np.arange(6.0), of_walls=np.nan)
    assert values[:3].tolist() == [0.0, 1.0, 2.0] and np.isnan(values[3:]).all()
    assert frame.images is images  # computed once


def test_flat_walls_with_a_fixed_particle_hold_the_slab():
    p = between_lines()
    pinned = p.with_state(fixed=np.array([True, False, False, True, True]))
    assert (p.frame.translations, pinned.frame.translations) == (1, 0) and pinned.frame.is_flat


def test_rims_of_droplets_lie_before_flat_walls():
    """Contacts at delta of a vertex and a line that is half a rim behind the plane."""
    p = droplets()
    x = np.append(p.positions, [[0.3, 0.5], [0.7, 5.5]], axis=0)
    flat = jamlab.Packing(
        "dp",
        BOX,
        x,
        DROPLETS | {"a0": [0.25] * 4 + [0.0, 0.0]},
        offsets=[0, 4, 8, 12, 16, 17, 18],
        fixed=np.arange(6) > 3,
        walls=True,
    )
    assert np.allclose(flat.frame.planes, (0.55, 5.45)) and len(flat.frame.images.offsets) == 9
    assert np.allclose(flat.frame.images.polygons.areas, 0.25)  # counter-clockwise, images as well


BAD = {
    "numbers": ({"fixed": np.zeros(4)}, "must be an array of truth values"),
    "short": ({"fixed": np.zeros(3, dtype=bool)}, "4 truth values"),
    "all": ({"fixed": np.ones(4, dtype=bool)}, "leave at least one free"),
    "no wall": ({"walls": True}, "no particle is fixed"),
    "stretched": ({"walls": True, "fixed": OUTER, "ensemble": "shear-stabilized"}, "walls keep their shape"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_no_frame_is_refused(case):
    more, words = BAD[case]
    with pytest.raises(jamlab.InputError, match=words):
        disks(**more)


def test_lines_that_nothing_holds_are_refused():
    p = between_lines()
    for fixed, walls in ((p.fixed, False), (np.arange(5) > 3, True), (np.arange(5) == 0, True)):
        with pytest.raises(jamlab.InputError, match=r"diameters\[3\] = 0"):
            jamlab.Packing("sp", BOX, p.positions, {"k": 1.0}, "k", p.diameters, fixed=fixed, walls=walls)


def test_a_mask_that_fixes_nothing_is_none():
    assert disks(fixed=np.zeros(4, dtype=bool)).fixed is None


class Piston(Frame):
    """A periodic box of constant width, under a piston."""

    strains = np.array([SIMPLE_SHEAR, ALONG_Y])
    squeeze = ALONG_Y
    limits = "in a box of constant width"


@pytest.fixture
def piston(monkeypatch):
    p = jamlab.pack(n=16, pressure=2e-2, seed=1)
    monkeypatch.setattr("jamlab.packing.packing.frame_of", Piston)
    return p


def test_another_frame_is_a_class(piston):
    """Compression, pressure, bulk modulus and what is refused follow from its answers alone."""

    def energy(height):
        map_ = np.diag([1.0, height])
        moved = piston.with_state(box=piston.box @ map_, positions=piston.positions @ map_, ensemble="fixed-box")
        return jamlab.evaluate(jamlab.relax(moved, force_tolerance=1e-12)).energy

    step = 1e-5
    low, here, high = (energy(1 + k * step) for k in (-1, 0, 1))
    pressure = -(high - low) / (2 * step * piston.area)
    assert jamlab.measure(piston, ["pressure"])["pressure"] == pytest.approx(pressure, rel=1e-5)
    assert jamlab.bulk_modulus(piston) == pytest.approx((high - 2 * here + low) / (step**2 * piston.area), rel=1e-4)
    dense = list(jamlab.compress(piston, to=jamlab.packing_fraction(piston) + 0.01, step=0.005))[-1]
    assert dense.box[0, 0] == pytest.approx(piston.box[0, 0], rel=1e-12) and dense.box[1, 1] < piston.box[1, 1]
    with pytest.raises(jamlab.InputError, match="not defined in a box of constant width"):
        jamlab.shear_modulus(piston, direction="pure")
