"""The bulk modulus, and finite strain in every direction, against closed forms and numeric differentiation."""

import numpy as np
import pytest

import jamlab

ANGLES = (0.0, 0.7, 1.9)


@pytest.fixture(scope="module")
def packings():
    """Disks of both force laws, near onset and deep."""
    onset = jamlab.jam("sp", 16, seed=2)
    *_, eps = jamlab.compress(onset, to=0.88, step=0.05, by="phi")
    return {"near": jamlab.pack(32, 1e-4, seed=3), "deep": jamlab.pack(32, 3e-2, seed=4), "eps": eps}


@pytest.fixture(params=["near", "deep", "eps"])
def packing(packings, request):
    return packings[request.param]


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


# closed forms ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["linear-response", "affine", "finite-strain"])
@pytest.mark.parametrize("pressed", [1e-6, 0.05])
def test_triangular_lattice(pressed, method):
    """p = sqrt(3) k (1 - a)/a, so B = -(a/2) dp/da = (sqrt(3)/2) k/a; G = (sqrt(3)/4) k where overlaps vanish."""
    p, a = triangular(pressed)
    strain = 1e-7  # below the overlap of 1e-6
    exact = method != "finite-strain"
    assert jamlab.bulk_modulus(p, method, strain=strain) == pytest.approx(
        np.sqrt(3) / 2 * 2.0 / a, rel=1e-9 if exact else 1e-6
    )
    if pressed == 1e-6:
        g = jamlab.shear_modulus(p, method, angle=ANGLES, strain=strain)
        assert g == pytest.approx(np.sqrt(3) / 4 * 2.0, rel=1e-5)


@pytest.mark.parametrize(
    "method",
    [
        "finite-strain",
        "affine",
        "linear-response",
    ],
)
@pytest.mark.parametrize("pressed", [1e-4, 0.1])
def test_two_disks(pressed, method):
    """p = k (1 - r)/r: B = k/(2r). Shear along the cell G = (k - f/r)/2; along the bonds -f/r, which buckles.

    Each disk is a centre of symmetry: no strain puts a force on it, the coupling is exactly zero.
    """
    p, r = two_disks(pressed)
    k, f = 2.0, 2.0 * pressed
    assert jamlab.evaluate(p).pressure == pytest.approx(f / r, rel=1e-9)
    assert jamlab.bulk_modulus(p, method) == pytest.approx(k / (2 * r), rel=1e-6)
    g = jamlab.shear_modulus(p, method, angle=[0, np.pi / 4, np.pi / 2])
    assert g == pytest.approx([(k - f / r) / 2, -f / r, (k - f / r) / 2], rel=1e-6, abs=1e-8)


# bulk modulus ---------------------------------------------------------------------------------------------------------


def test_bulk_modulus_three_ways(packing):
    """Relaxed by Hessian and by LAMMPS alike; sites that follow the strain are stiffer."""
    relaxed = jamlab.bulk_modulus(packing)
    assert jamlab.bulk_modulus(packing, "finite-strain") == pytest.approx(relaxed, rel=1e-5)
    assert 0 < relaxed < jamlab.bulk_modulus(packing, "affine")


def test_bulk_modulus_of_droplets(dp_dense):
    """Droplets keep their shapes when the box shrinks; relaxed, they give way far more than affine polygons."""
    relaxed = jamlab.bulk_modulus(dp_dense)
    assert jamlab.bulk_modulus(dp_dense, "finite-strain") == pytest.approx(relaxed, rel=1e-5)
    assert 0 < relaxed < jamlab.bulk_modulus(dp_dense, "affine")


def test_bulk_modulus_is_the_slope_of_the_pressure(packing):
    """dp/dln(phi) of two minimised boxes, scaled here, sites guessed affinely, pressure from the contacts' forces."""
    step = 1e-7
    pressure = []
    with jamlab.Session(packing) as session:
        for factor in (1 - step, 1 + step):
            session.load(packing.with_state(box=factor * packing.box, positions=factor * packing.positions))
            session.minimize(2e-14, style="cg", steps=20_000)
            pressure.append(contact_pressure(session.packing()))
    slope = (pressure[0] - pressure[1]) / (4 * step)  # phi ~ factor^-2
    assert jamlab.bulk_modulus(packing) == pytest.approx(slope, rel=1e-4)


def contact_pressure(p):
    """sum of f r / 2A over pairs, by a loop over images."""
    total = 0.0
    for i in range(p.n):
        for image in np.ndindex(3, 3):
            r = np.hypot(*(p.positions[:i] - p.positions[i] + (np.array(image) - 1) @ p.box).T)
            s = 0.5 * (p.diameters[i] + p.diameters[:i])
            k = p.params["k"] if p.units == "k" else p.params["eps"] / s**2
            total += np.sum((k * (s - r) * r)[r < s])
    return total / (2 * p.area)


def test_bulk_modulus_does_not_see_the_orientation(packings):
    """Turned by 90 degrees, shifted, particles renumbered."""
    p = packings["deep"]
    order = np.random.default_rng(0).permutation(p.n)
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    x = (p.positions @ turn + [0.3, -7.0])[order]
    turned = p.with_state(positions=x, box=p.box[::-1, ::-1], diameters=p.diameters[order])
    assert jamlab.bulk_modulus(turned) == pytest.approx(jamlab.bulk_modulus(p), rel=1e-9)


# finite strain --------------------------------------------------------------------------------------------------------


def test_finite_shear_in_several_directions(packing):
    """The frame is turned to keep LAMMPS' box: the stress must be turned back. One angle gives a number, more a row."""
    linear = jamlab.shear_modulus(packing, angle=ANGLES)
    finite = jamlab.shear_modulus(packing, "finite-strain", angle=ANGLES)
    assert finite.shape == (len(ANGLES),)
    assert np.ptp(linear) > 1e-3 * np.abs(linear).max()  # directions differ
    assert np.abs(finite - linear).max() < 1e-5 * np.abs(linear).max()
    one = jamlab.shear_modulus(packing, "finite-strain", angle=ANGLES[1])
    assert isinstance(one, float) and one == pytest.approx(finite[1], rel=1e-6)


def test_finite_shear_average(packing):
    """Over all directions, as linear response over 36."""
    every = jamlab.shear_modulus(packing, angle=np.linspace(0, np.pi, 36, endpoint=False))
    assert jamlab.shear_modulus(packing, "finite-strain", average=True) == pytest.approx(every.mean(), rel=1e-5)


def test_finite_shear_of_droplets(dp_dense):
    """Strain below the default: at 1e-6 the response of droplets is off by 1e-4, and the error grows as its square."""
    linear = jamlab.shear_modulus(dp_dense, angle=ANGLES)
    finite = jamlab.shear_modulus(dp_dense, "finite-strain", angle=ANGLES)
    assert np.abs(finite - linear).max() < 1e-5 * np.abs(linear).max()


def test_strain_is_halved_until_no_contact_changes():
    """Overlaps of 1e-6 open at a strain of 1e-2; the answer is that of the lattice all the same."""
    p, a = triangular(1e-6)
    assert jamlab.bulk_modulus(p, "finite-strain", strain=1e-3) == pytest.approx(np.sqrt(3) / a, rel=1e-5)
    assert jamlab.shear_modulus(p, "finite-strain", strain=1e-3) == pytest.approx(np.sqrt(3) / 2, rel=1e-5)


# refused --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("strain", [0.0, -1e-6, 0.2, float("nan"), "x"])
@pytest.mark.parametrize("modulus", [jamlab.bulk_modulus, jamlab.shear_modulus])
def test_strains_that_are_none(packings, modulus, strain):
    """Named."""
    with pytest.raises(jamlab.InputError, match=rf"strain = {strain!r}.*(at most 0\.1|must be a number)"):
        modulus(packings["deep"], "finite-strain", strain=strain)


def test_what_has_no_bulk_modulus(packings, random_disks):
    """Unknown methods, loose packings, states that are no minimum."""
    with pytest.raises(jamlab.InputError, match=r"'born'.*linear-response"):
        jamlab.bulk_modulus(packings["deep"], "born")
    with pytest.raises(jamlab.ConvergenceError, match="every particle rattles"):
        jamlab.bulk_modulus(random_disks(phi=0.01))
    with pytest.raises(jamlab.ConvergenceError, match="not at an energy minimum"):
        jamlab.bulk_modulus(random_disks(phi=1.1))
