"""Disks and droplets of any sizes: distributions, packings against plain loops, what no packing can have."""

import numpy as np
import pytest

import jamlab
from jamlab.packing import lammps_files
from jamlab.protocols.random_start import droplet_params, random_disks
from jamlab.protocols.size_distributions import SizeDistribution, sizes_record
from studies.stability.plain_physics import plain_complex_modulus, plain_shear_modulus
from tests.support.reference import evaluate as plain_sums

NAMED = [
    "monodisperse",
    "bidisperse:1.4,0.25",
    "uniform:0.3",
    "gaussian:0.2",
    "lognormal:0.3",
    "lognormal:0.6",
    "power-law:-3,0.5,5",
    "power-law:-1,1,10",
    "power-law:-3,1,40",
    "power-law:-2,1,20",
]
ONE_TO_TEN = np.geomspace(0.2, 2.0, 80)


@pytest.mark.parametrize("text", NAMED)
def test_three_moments_of_64_drawn_disks_are_those_of_the_distribution(text):
    law = SizeDistribution.of(text)
    ends = np.array([*np.linspace(0, 1, 9)[:-1], *(1 - 10.0 ** -np.arange(2, 12)), 1.0])  # long tails at the upper end
    places, weights = np.polynomial.legendre.leggauss(60)
    middle, half = 0.5 * (ends[1:] + ends[:-1])[:, None], 0.5 * np.diff(ends)[:, None]
    quantiles, share = law.quantiles((middle + half * places).ravel()), (half * weights).ravel()
    mean, square, cube = (share @ quantiles**k for k in (1, 2, 3))
    drawn = law.draw(64, seed=1)
    assert drawn.mean() == pytest.approx(1.0, abs=1e-12)
    assert mean == pytest.approx(1.0, abs=1e-6)
    assert law.width == pytest.approx(np.sqrt(max(square - mean**2, 0.0)), abs=1e-4)
    assert drawn.std() == pytest.approx(law.width, abs=1e-3)
    assert (drawn**2).mean() == pytest.approx(square, rel=1e-3)
    assert (drawn**3).mean() == pytest.approx(cube, rel=1e-4)
    assert (np.diff(drawn) >= 0).all() and drawn[0] > 0


def test_a_skewness_that_no_64_numbers_have_is_not_met_and_the_packing_says_so():
    text, most = "power-law:-3,1,50", 62 / np.sqrt(63)  # of one large disk among 63 alike
    drawn = SizeDistribution.of(text).draw(64, 1)
    record = sizes_record(text, drawn)["sizes"]
    assert record["skewness"] < most < record["law_skewness"] == SizeDistribution.of(text).skewness
    assert 0.7 * record["law_width"] < record["width"] <= record["law_width"] * (1 + 1e-12)
    assert SizeDistribution.of("bidisperse:3,0.1").skewness == pytest.approx(0.8 / 0.3, rel=1e-12)


def test_random_draws_follow_the_law_and_the_seed():
    law = SizeDistribution.of("lognormal:0.3,random")
    first, again, other = law.draw(20_000, 1), law.draw(20_000, 1), law.draw(20_000, 2)
    assert (first == again).all() and (first != other).all()
    assert first.mean() == pytest.approx(1.0, abs=5 * 0.3 / np.sqrt(20_000))
    assert np.log(first).std() == pytest.approx(np.sqrt(np.log(1.09)), rel=0.03)


def assert_same_sums(found, expected):
    assert found.energy == pytest.approx(expected.energy, rel=1e-12)
    assert np.abs(found.forces - expected.forces).max() < 1e-12
    assert np.abs(found.stress - expected.stress).max() < 1e-12


@pytest.fixture(scope="module")
def many():
    return jamlab.pack(n=len(ONE_TO_TEN), pressure=1e-2, seed=2, sizes=ONE_TO_TEN)


def test_a_packing_of_80_sizes_is_that_of_plain_loops(many):
    assert many.converged and (many.diameters == ONE_TO_TEN).all()
    assert_same_sums(found := jamlab.evaluate(many), plain_sums(many))
    assert found.pressure == pytest.approx(1e-2, rel=1e-6)
    voids = jamlab.voids(many)
    assert voids.area.sum() == pytest.approx((1 - jamlab.packing_fraction(many)) * many.area, rel=1e-10)
    assert jamlab.shear_modulus(many, direction="simple") == pytest.approx(plain_shear_modulus(many), rel=1e-11)
    spectrum = jamlab.complex_modulus(many, [0.1])
    expected = plain_complex_modulus(many, 0.1)
    assert spectrum.storage[0] + 1j * spectrum.loss[0] == pytest.approx(expected, rel=1e-11)
    record = many.provenance["sizes"]
    assert record["law"] == "given" and record["smallest"] == 0.2 and record["largest"] == 2.0


@pytest.mark.parametrize("units", ["eps", "k"])
@pytest.mark.parametrize("exponent", [2.0, 2.5])
def test_diameters_by_disk_and_by_type_are_one_law(monkeypatch, units, exponent):
    """One packing with a type for each size, and with types as classes of size."""
    packing = random_disks(41, 5, phi=1.0, units=units, sizes="lognormal:0.4", exponent=exponent)
    by_type, expected = lammps_files.types(packing), jamlab.evaluate(packing)
    monkeypatch.setattr(lammps_files, "MAX_TYPES", 3)
    classes, found = lammps_files.types(packing), jamlab.evaluate(packing)
    assert not by_type.classes and by_type.ntypes == 41
    assert classes.classes and classes.ntypes <= lammps_files.CLASSES
    assert_same_sums(found, expected)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_few_disks_jam(n):
    onset = jamlab.jam(n=n, seed=1, sizes="lognormal:0.3")
    assert onset.n == n and onset.converged and 0 < jamlab.evaluate(onset).energy < 1e-12
    packed = jamlab.pack(n=n, pressure=1e-3, seed=1, sizes="lognormal:0.3")
    assert jamlab.evaluate(packed).pressure == pytest.approx(1e-3, rel=1e-6)


def test_diameters_from_a_file(tmp_path):
    path = tmp_path / "diameters.txt"
    path.write_text("1.0\n1.25\n0.75, 1.0 1.5\n")
    assert random_disks(5, 1, phi=0.2, sizes=f"from-file:{path}").diameters.tolist() == [1.0, 1.25, 0.75, 1.0, 1.5]
    path.write_text("1.0 wide")
    with pytest.raises(jamlab.InputError, match="wide"):
        jamlab.pack(n=2, pressure=1e-3, sizes=f"from-file:{path}")


TEN_SIZES = np.geomspace(0.2, 2.0, 10)


@pytest.fixture(scope="module")
def droplets():
    onset = jamlab.jam(model="dp", n=10, seed=1, sizes=TEN_SIZES, start="from-disks")
    *_, pressed = jamlab.compress(onset, onset.phi + 0.02, 0.02, by="phi")
    return pressed


def test_droplets_of_one_to_ten_are_those_of_plain_loops(droplets):
    own = TEN_SIZES / TEN_SIZES.mean()
    assert droplets.converged and droplets.params["a0"] == pytest.approx(own**2, rel=1e-12)
    assert np.diff(droplets.offsets).tolist() == np.maximum(3, np.rint(14.5 * own)).tolist()
    assert_same_sums(found := jamlab.evaluate(droplets), plain_sums(droplets))
    assert found.pressure > 1e-4
    voids, rho = jamlab.voids(droplets), jamlab.packing_fraction(droplets)
    assert voids.area.sum() == pytest.approx((1 - rho) * droplets.area, rel=1e-9)
    assert jamlab.tessellation(droplets).area.sum() == pytest.approx(droplets.area, rel=1e-9)


@pytest.mark.parametrize("vertices", [9, [8, 9, 20]])
def test_vertices_are_given_for_all_or_for_each(vertices):
    p = jamlab.jam(model="dp", n=3, seed=2, sizes=[3.0, 4.0, 5.0], law={"vertices": vertices})
    assert np.diff(p.offsets).tolist() == np.broadcast_to(vertices, 3).tolist()
    assert np.sqrt(p.params["a0"]) == pytest.approx([0.75, 1.0, 1.25], rel=1e-12)
    assert p.converged and p.provenance["sizes"]["width"] == pytest.approx(np.std([0.75, 1, 1.25]), rel=1e-12)


def test_sizes_of_the_decks_are_the_default():
    nv, params = droplet_params(4)
    again, same = droplet_params(4, 0.5, np.array([12.0, 12, 17, 17]))
    assert nv.tolist() == again.tolist() == [12, 12, 17, 17]
    assert params["a0"] == pytest.approx(same["a0"], rel=1e-15)


def test_disks_of_one_to_ten_are_handed_over():
    disks = jamlab.pack(n=10, pressure=1e-2, seed=1, sizes=TEN_SIZES)
    made = jamlab.droplets_from_disks(disks, law={"delta": 0.1})
    assert made.converged and made.n == 10
    assert jamlab.packing_fraction(made) == pytest.approx(jamlab.packing_fraction(disks), abs=2e-6)
    assert np.diff(jamlab.droplets_from_disks(disks, law={"delta": 0.1, "vertices": 12}).offsets).tolist() == [12] * 10


@pytest.mark.parametrize("text", ["power-law:-2.45,1,20", "power-law:-3,1,10", "power-law:-2,1,100", "uniform:0.5"])
@pytest.mark.parametrize("n", [2, 3, 5, 8, 16, 64])
def test_strata_stay_between_the_cut_offs(text, n):
    """Few disks cannot have the width of a law without leaving it; their mean is that of the law in any case."""
    law = SizeDistribution.of(text)
    drawn = law.draw(n, 1)
    smallest, largest = law.quantiles(np.array([0.0, 1.0]))
    assert smallest <= drawn.min() and drawn.max() <= largest
    assert drawn.mean() == pytest.approx(1.0, rel=1e-12)
    assert drawn.std() <= law.width * (1 + 1e-12) and (n < 64 or drawn.std() == pytest.approx(law.width, rel=1e-12))
