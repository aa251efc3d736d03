"""Moduli of shear and bulk, and G*(omega), against finite strain, closed forms and numeric differentiation."""

from pathlib import Path

import numpy as np
import pytest

import jamlab
from studies.stability.plain_physics import plain_moduli

ANGLES = (0.0, 0.7, 1.9)
EVERY_ANGLE = np.linspace(0, np.pi, 36, endpoint=False)
STATES = Path(__file__).with_name("states")


@pytest.fixture(scope="module")
def packings(dp_dense):
    """Packings of disks, of both force laws and from near onset to deep compression, and droplets."""
    *_, eps = jamlab.compress(jamlab.jam(model="sp", n=32, seed=2), to=0.90, step=0.05, by="phi")
    return {
        "near": jamlab.pack(n=32, pressure=1e-4, seed=3),
        "deep": jamlab.pack(n=32, pressure=3e-2, seed=4),
        "eps": eps,
        "droplets": dp_dense,
    }


@pytest.fixture(params=["near", "deep", "eps"])
def packing(packings, request):
    return packings[request.param]


@pytest.fixture(params=["near", "deep", "eps", "droplets"])
def any_packing(packings, request):
    return packings[request.param]


def test_relaxation_can_only_soften(any_packing):
    """The affine modulus is an upper bound in every direction. Relaxed ones may be negative: the box is held."""
    relaxed, affine = (
        jamlab.shear_modulus(any_packing, m, direction=EVERY_ANGLE) for m in ("linear-response", "affine")
    )
    assert np.all(relaxed <= affine)
    assert relaxed.mean() < 0.9 * affine.mean()


@pytest.mark.parametrize("method", ["linear-response", "affine"])
def test_average_is_the_mean_over_angles(packing, method):
    """Three angles do the work of thirty-six, though single ones differ."""
    values = jamlab.shear_modulus(packing, method, direction=EVERY_ANGLE)
    assert jamlab.shear_modulus(packing, method) == pytest.approx(np.mean(values), rel=1e-12)
    assert np.ptp(values) > 1e-3 * np.mean(values)


@pytest.mark.parametrize("name", ["near", "deep", "eps"])
def test_the_mean_over_directions_is_that_of_a_plain_tensor(packings, name):
    """Complex steps of the forces, a dense pseudo-inverse and 48 angles. The mean of simple and pure shear is another
    number: it differs by a quarter of the difference of the normal stresses, which works on the rotation."""
    p, angle = packings[name], np.pi * np.arange(48) / 48
    a, b = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]).transpose(0, 2, 1)
    wanted = np.einsum("ni,nj,ijkl,nk,nl->n", a, b, plain_moduli(p), a, b).mean()
    assert jamlab.shear_modulus(p) == jamlab.measure(p, "g")["g"] == pytest.approx(wanted, rel=1e-9)
    assert jamlab.shear_modulus(p, "finite-strain") == pytest.approx(wanted, rel=1e-6)
    two = [jamlab.shear_modulus(p, direction=way) for way in ("simple", "pure")]
    stress = jamlab.evaluate(p).stress
    assert wanted - np.mean(two) == pytest.approx((stress[1, 1] - stress[0, 0]) / 4, rel=1e-6, abs=1e-12)


def test_angles_give_an_array_and_one_direction_a_number(packings):
    p = packings["near"]
    for angles in ([0.3], (0.3, 1.0), np.array([0.3, 1.0])):
        found = jamlab.shear_modulus(p, direction=angles)
        assert found.shape == (len(angles),) and found[0] == jamlab.shear_modulus(p, direction=0.3)
    assert jamlab.shear_modulus(p, direction=0.0) == jamlab.shear_modulus(p, direction="simple")
    for one in (None, "simple", "pure", 1, np.float32(0.5), np.array(0.5)):
        assert type(jamlab.shear_modulus(p, direction=one)) is float


def triangular(pressed):
    """4 x 6 unit disks of stiffness 2 at distance a = 1 - pressed, and a."""
    a = 1 - pressed
    i, j = np.divmod(np.arange(24), 6)
    x = np.column_stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j])
    return jamlab.Packing("sp", a * np.diag([4.0, 6 * np.sqrt(0.75)]), a * x, {"k": 2.0}, "k", np.ones(24)), a


def two_disks(pressed):
    """Centred square cell: four contacts, all between disk 0 and images of disk 1 at distance r; and r."""
    r = 1 - pressed
    side = np.sqrt(2) * r
    x = [[0, 0], [side / 2, side / 2]]
    return jamlab.Packing("sp", side * np.eye(2), x, {"k": 2.0}, "k", np.ones(2)), r


@pytest.mark.parametrize("method", ["linear-response", "affine", "finite-strain"])
@pytest.mark.parametrize("pressed", [1e-6, 0.05])
def test_triangular_lattice(pressed, method):
    """p = sqrt(3) k (1 - a)/a, so B = -(a/2) dp/da = (sqrt(3)/2) k/a; G = (sqrt(3)/4) (k - 3 f/a)."""
    p, a = triangular(pressed)
    exact = method != "finite-strain"
    strain = None if exact else 1e-7  # below the overlap of 1e-6
    b = jamlab.bulk_modulus(p, method, strain_step=strain)
    assert b == pytest.approx(np.sqrt(3) / 2 * 2.0 / a, rel=1e-9 if exact else 1e-6)
    g = jamlab.shear_modulus(p, method, direction=ANGLES, strain_step=strain)
    assert g == pytest.approx(np.sqrt(3) / 4 * (2.0 - 3 * 2.0 * pressed / a), rel=1e-9 if exact else 1e-5)
    assert jamlab.evaluate(p).pressure == pytest.approx(np.sqrt(3) * 2.0 * pressed / a, rel=1e-9)


@pytest.mark.parametrize("method", ["finite-strain", "affine", "linear-response"])
@pytest.mark.parametrize("pressed", [1e-4, 0.1])
def test_two_disks(pressed, method):
    """p = k (1 - r)/r: B = k/(2r). Shear along the cell G = (k - f/r)/2; along the bonds -f/r, which buckles.

    Each disk is a centre of symmetry: no strain puts a force on it, the coupling is exactly zero.
    """
    p, r = two_disks(pressed)
    k, f = 2.0, 2.0 * pressed
    assert jamlab.evaluate(p).pressure == pytest.approx(f / r, rel=1e-9)
    assert jamlab.bulk_modulus(p, method) == pytest.approx(k / (2 * r), rel=1e-6)
    g = jamlab.shear_modulus(p, method, direction=[0, np.pi / 4, np.pi / 2])
    assert g == pytest.approx([(k - f / r) / 2, -f / r, (k - f / r) / 2], rel=1e-6, abs=1e-8)


def test_bulk_modulus_three_ways(any_packing):
    """Relaxed by Hessian and by LAMMPS alike; sites that follow the strain are stiffer."""
    relaxed = jamlab.bulk_modulus(any_packing)
    assert jamlab.bulk_modulus(any_packing, "finite-strain") == pytest.approx(relaxed, rel=1e-5)
    assert 0 < relaxed < jamlab.bulk_modulus(any_packing, "affine")


def test_finite_shear_in_several_directions(any_packing):
    """The frame is turned to keep LAMMPS' box: the stress must be turned back. One angle gives a number, more a row."""
    linear = jamlab.shear_modulus(any_packing, direction=ANGLES)
    finite = jamlab.shear_modulus(any_packing, "finite-strain", direction=ANGLES)
    assert finite.shape == (len(ANGLES),)
    assert np.ptp(linear) > 1e-3 * np.abs(linear).max()  # directions differ
    assert np.abs(finite - linear).max() < 1e-5 * np.abs(linear).max()
    one = jamlab.shear_modulus(any_packing, "finite-strain", direction=ANGLES[1])
    assert isinstance(one, float) and one == pytest.approx(finite[1], rel=1e-6)


def test_strain_is_halved_until_no_contact_changes():
    """Overlaps of 1e-6 open at a strain of 1e-2; the answer is that of the lattice all the same."""
    p, a = triangular(1e-6)
    assert jamlab.bulk_modulus(p, "finite-strain", strain_step=1e-3) == pytest.approx(np.sqrt(3) / a, rel=1e-5)
    assert jamlab.shear_modulus(p, "finite-strain", strain_step=1e-3) == pytest.approx(np.sqrt(3) / 2, rel=1e-5)


def test_a_droplet_squeezed_by_two_others_bears_load():
    """For z it is a rattler, as a disk would be; taken out, its neighbors were out of balance and G was not defined."""
    p = jamlab.read(STATES / "squeezed_droplet.h5")  # n = 16, 0.003 above onset
    found = jamlab.contacts(p)
    squeezed = found.rattlers & (np.bincount(found.pairs.ravel(), minlength=p.n) == 2)
    assert squeezed.sum() == 1
    assert jamlab.shear_modulus(p) == pytest.approx(jamlab.shear_modulus(p, "finite-strain"), rel=1e-3)


@pytest.mark.parametrize("lean", [pytest.param(0, marks=pytest.mark.slow), 7])
@pytest.mark.parametrize("modulus", [jamlab.shear_modulus, jamlab.bulk_modulus])
def test_rounding_of_positions_leaves_finite_strain_its_digits(packings, modulus, lean):
    """The same packing in a leaning box, whose sites lie further from the origin: forces cannot be brought to 1e-13."""
    p = packings["droplets"]
    q = p.with_state(box=p.box + np.outer([0, lean], p.box[0]))
    assert modulus(q, "finite-strain") == pytest.approx(modulus(p), rel=2e-6)


def test_weak_contacts_of_spheres_are_extrapolated_to_no_strain():
    """Hertzian disks on a triangular lattice: a strain of a quarter of the overlap alone is off by 6e-4."""
    a = 0.98
    x = np.array([[i + 0.5 * j, np.sqrt(0.75) * j] for j in range(4) for i in range(4)]) * a
    box = 4 * a * np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
    p = jamlab.Packing("sp", box, x, {"k": 1.0, "exponent": 2.5}, "k", np.ones(16))
    assert jamlab.bulk_modulus(p, "finite-strain", strain_step=1e-2) == pytest.approx(jamlab.bulk_modulus(p), rel=5e-5)
