"""Disks and droplets of any sizes: distributions, packings against plain loops, what no packing can have."""

from itertools import combinations, product

import numpy as np
import pytest
from campaigns import read_campaign_file, written
from scipy.integrate import quad

import jamlab
from jamlab.campaign.states import make_states
from jamlab.campaign.tasks import Parameters, batches
from jamlab.estimates.flow_errors import Flow, read_errors
from jamlab.packing import lammps_files
from jamlab.protocols.random_start import droplet_params, random_disks
from jamlab.protocols.size_distributions import SizeDistribution, sizes_record
from studies.failure.plain_physics import plain_complex_modulus, plain_shear_modulus
from tests.support.reference import evaluate as plain_sums
from tests.support.tiled_packings import tiled

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
    points = [*np.linspace(0, 1, 9)[1:-1].tolist(), 0.99, 0.999]
    powers = (lambda u, k=k: law.quantiles(np.array([u]))[0] ** k for k in (1, 2, 3))
    mean, square, cube = (quad(power, 0, 1, limit=400, points=points)[0] for power in powers)
    drawn = law.draw(64, seed=1)
    assert drawn.mean() == pytest.approx(1.0, abs=1e-12)
    assert mean == pytest.approx(1.0, abs=1e-6)
    assert law.width == pytest.approx(np.sqrt(max(square - mean**2, 0.0)), abs=1e-4)
    assert drawn.std() == pytest.approx(law.width, abs=1e-3)
    assert (drawn**2).mean() == pytest.approx(square, rel=1e-3)
    assert (drawn**3).mean() == pytest.approx(cube, rel=1e-4)
    assert (np.diff(drawn) >= 0).all() and drawn[0] > 0


@pytest.mark.parametrize("text", NAMED[:-2])
@pytest.mark.parametrize("n", [2, 3, 5])
def test_few_disks_have_the_mean_and_the_width_as_well(text, n):
    law = SizeDistribution.of(text)
    if law.name == "bidisperse" and n == 2:
        with pytest.raises(jamlab.InputError):
            law.draw(n, 1)
        return
    drawn = law.draw(n, 1)
    assert drawn.mean() == pytest.approx(1.0, abs=1e-12)
    if law.name not in ("bidisperse", "power-law"):  # cut-offs come first, see below
        assert drawn.std() == pytest.approx(law.width, abs=1e-12)


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


def assert_doubling_changes_nothing(one):
    """What four cells side by side have in common with one; the four."""
    four = tiled(one, 2)
    first, second = jamlab.evaluate(one), jamlab.evaluate(four)
    assert second.energy == pytest.approx(4 * first.energy, rel=1e-10)
    assert np.abs(second.stress - first.stress).max() < 1e-10
    assert jamlab.contacts(four).z == pytest.approx(jamlab.contacts(one).z, rel=1e-10)
    assert jamlab.packing_fraction(four) == pytest.approx(jamlab.packing_fraction(one), rel=1e-10)
    return four


def test_short_forms_and_names_give_the_same_two_sizes_bit_by_bit():
    short, named = (random_disks(16, 3, phi=0.5, **how) for how in ({"ratio": 1.7}, {"sizes": "bidisperse:1.7,0.5"}))
    assert (short.diameters == named.diameters).all() and (short.positions == named.positions).all()


@pytest.fixture(scope="module")
def many():
    return jamlab.pack(n=len(ONE_TO_TEN), pressure=1e-2, seed=2, sizes=ONE_TO_TEN)


def area_of_lens(a, b, d):
    """Area that two disks of radii a and b share at distance d."""
    angles = [np.arccos((d**2 + one**2 - other**2) / (2 * d * one)) for one, other in ((a, b), (b, a))]
    return sum(r**2 * (angle - np.sin(2 * angle) / 2) for r, angle in zip((a, b), angles, strict=True))


def covered(packing):
    """Packing fraction of disks of which no three overlap in one point."""
    r, images = packing.diameters / 2, np.array(list(product((-1, 0, 1), repeat=2))) @ packing.box
    area = np.pi * (r**2).sum()
    for i, j in combinations(range(packing.n), 2):
        distances = np.hypot(*(packing.positions[j] - packing.positions[i] + images).T)
        area -= sum(area_of_lens(r[i], r[j], d) for d in distances if d < r[i] + r[j])
    return area / packing.area


def test_a_packing_of_80_sizes_is_that_of_plain_loops(many):
    assert many.converged and (many.diameters == ONE_TO_TEN).all()
    assert_same_sums(found := jamlab.evaluate(many), plain_sums(many))
    assert found.pressure == pytest.approx(1e-2, rel=1e-6)
    assert jamlab.packing_fraction(many) == pytest.approx(covered(many), rel=1e-12)
    voids = jamlab.voids(many)
    assert voids.area.sum() == pytest.approx((1 - jamlab.packing_fraction(many)) * many.area, rel=1e-10)
    assert jamlab.shear_modulus(many) == pytest.approx(plain_shear_modulus(many), rel=1e-11)
    spectrum = jamlab.complex_modulus(many, [0.1])
    expected = plain_complex_modulus(many, 0.1)
    assert spectrum.storage[0] + 1j * spectrum.loss[0] == pytest.approx(expected, rel=1e-11)
    record = many.provenance["sizes"]
    assert record["law"] == "given" and record["smallest"] == 0.2 and record["largest"] == 2.0


def test_doubling_the_cell_changes_nothing(many):
    four = assert_doubling_changes_nothing(many)
    # without prestress, since of four cells it makes longer modes unstable
    moduli = [jamlab.complex_modulus(p, [0.1], prestress=False) for p in (many, four)]
    assert moduli[1].storage[0] == pytest.approx(moduli[0].storage[0], rel=1e-10)
    assert moduli[1].loss[0] == pytest.approx(moduli[0].loss[0], rel=1e-10)


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


@pytest.mark.parametrize("exponent", [2.0, 2.5])
def test_flow_is_the_same_with_diameters_by_disk_and_by_type(monkeypatch, exponent):
    packing = jamlab.pack(n=41, pressure=1e-2, seed=5, sizes="lognormal:0.4", exponent=exponent)
    how = {"rate": 1e-3, "strain": 0.01, "damping": jamlab.ContactDamping(beta=0.5)}
    expected = jamlab.shear(packing, **how)
    monkeypatch.setattr(lammps_files, "MAX_TYPES", 3)
    found = jamlab.shear(packing, **how)
    assert found.stress == pytest.approx(expected.stress, rel=1e-6)
    assert found.viscous_stress == pytest.approx(expected.viscous_stress, rel=1e-6)


def test_packings_keep_their_own_unit_of_length():
    given, small = (jamlab.pack(n=5, pressure=1e-2, seed=1, sizes=unit * np.arange(5.0, 10.0)) for unit in (1.0, 2e-6))
    assert small.converged and small.diameters == pytest.approx(2e-6 * given.diameters, rel=1e-12)
    assert small.phi == pytest.approx(given.phi, rel=1e-5)
    assert jamlab.evaluate(small).pressure == pytest.approx(1e-2, rel=1e-6)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_few_disks_jam(n):
    onset = jamlab.jam(n=n, seed=1, sizes="lognormal:0.3")
    assert onset.n == n and onset.converged and 0 < jamlab.evaluate(onset).energy < 1e-12
    packed = jamlab.pack(n=n, pressure=1e-3, seed=1, sizes="lognormal:0.3")
    assert jamlab.evaluate(packed).pressure == pytest.approx(1e-3, rel=1e-6)


def test_disks_of_one_to_twenty_pack_and_are_handed_over():
    packing = jamlab.pack(n=40, pressure=1e-2, seed=1, sizes="power-law:-2,1,20")
    assert_same_sums(jamlab.evaluate(packing), plain_sums(packing))
    droplets = jamlab.to_polygons(jamlab.pack(n=9, pressure=1e-3, seed=1, sizes="uniform:0.2"))
    assert droplets.n == 9 and droplets.converged


def test_diameters_from_a_file(tmp_path):
    path = tmp_path / "diameters.txt"
    path.write_text("1.0\n1.25\n0.75, 1.0 1.5\n")
    assert random_disks(5, 1, phi=0.2, sizes=f"from-file:{path}").diameters.tolist() == [1.0, 1.25, 0.75, 1.0, 1.5]
    path.write_text("1.0 wide")
    with pytest.raises(jamlab.InputError, match="wide"):
        jamlab.pack(n=2, pressure=1e-3, sizes=f"from-file:{path}")


@pytest.mark.parametrize(
    ("n", "sizes", "named"),
    [
        (8, "log-normal:0.3", "log-normal:0.3"),
        (8, "lognormal", "lognormal:WIDTH"),
        (8, "lognormal:wide", "lognormal:wide"),
        (8, "lognormal:nan", "lognormal:nan"),
        (8, "lognormal:0.3,0.4", "lognormal:0.3,0.4"),
        (8, "lognormal:-0.3", "-0.3"),
        (64, "gaussian:0.5", "-0."),
        (8, "uniform:0.6", "0.6"),
        (8, "bidisperse:1.4,1", "SHARE is 1"),
        (8, "bidisperse:1.4,0.01", "n = 8"),
        (8, "bidisperse:0.5,0.5", "RATIO is 0.5"),
        (8, "power-law:-3,2,1", "LARGEST is 1"),
        (8, "power-law:-3,1,1000", "LARGEST is 1000"),
        (8, "from-file:nowhere.txt", "nowhere.txt"),
        (8, [], "0 diameters"),
        (8, [1.0] * 7, "7 diameters"),
        (2, [1.0, -1.0], "sizes[1] is -1"),
        (2, [1.0, float("nan")], "sizes[1] is nan"),
        (2, [1.0, 1e6], "1e+06"),
        (1, "monodisperse", "n = 1"),
    ],
)
def test_sizes_that_no_packing_has_are_one_line(n, sizes, named):
    for call in (jamlab.jam, lambda **how: jamlab.pack(pressure=1e-3, **how)):
        with pytest.raises(jamlab.InputError) as caught:
            call(n=n, sizes=sizes)
        assert named in str(caught.value) and "\n" not in str(caught.value)


def test_sizes_replace_the_short_forms_and_are_of_disks():
    with pytest.raises(jamlab.InputError, match=r"ratio = 1\.4 and sizes = 'monodisperse': give one of them"):
        jamlab.pack(n=8, pressure=1e-3, ratio=1.4, sizes="monodisperse")
    message = r"ratio = 2\.0: droplets have the ratio of their vertices, .* or sizes"
    with pytest.raises(jamlab.InputError, match=message):
        jamlab.jam(model="dp", n=8, ratio=2.0)


def test_tables_of_errors_promise_nothing_of_sizes_that_they_have_not_seen():
    for call in (
        lambda: jamlab.scene(0.87, n=16, tolerance={"z": 0.5}, sizes="lognormal:0.3"),
        lambda: jamlab.estimate("z", rho=0.9, error=0.1, sizes="lognormal:0.3"),
    ):
        message = r"sizes = 'lognormal:0\.3': errors were measured of two sizes alone"
        with pytest.raises(jamlab.InputError, match=message):
            call()
    flow, two, few = Flow("oscillation", 1.0, 1.0, 0.1), {"ratio": 1.4}, {"large": 0.25}
    named = [
        [one.name for one in read_errors().outside(random_disks(64, 1, phi=0.95, units="k", **how), flow)]
        for how in (two, few, {"sizes": "lognormal:0.3"})
    ]
    width, ratio = "width of the diameters", "large over small diameter"
    assert [[name for name in one if name in (width, ratio)] for one in named] == [[], [width], [ratio, width]]


TEN_SIZES = np.geomspace(0.2, 2.0, 10)


@pytest.fixture(scope="module")
def droplets():
    onset = jamlab.jam(model="dp", n=10, seed=1, sizes=TEN_SIZES)
    *_, pressed = jamlab.compress(onset, onset.phi + 0.02, 0.02, by="phi")
    return pressed


def test_droplets_of_one_to_ten_are_those_of_plain_loops(droplets):
    own = TEN_SIZES / TEN_SIZES.mean()
    assert droplets.converged and droplets.params["a0"] == pytest.approx(own**2, rel=1e-12)
    assert np.diff(droplets.offsets).tolist() == np.maximum(3, np.rint(14.5 * own)).tolist()
    assert_same_sums(found := jamlab.evaluate(droplets), plain_sums(droplets))
    assert found.pressure > 1e-4
    assert_doubling_changes_nothing(droplets)
    voids, rho = jamlab.voids(droplets), jamlab.packing_fraction(droplets)
    assert voids.area.sum() == pytest.approx((1 - rho) * droplets.area, rel=1e-9)
    assert jamlab.tessellation(droplets).area.sum() == pytest.approx(droplets.area, rel=1e-9)


@pytest.mark.parametrize("vertices", [9, [8, 9, 20]])
def test_vertices_are_given_for_all_or_for_each(vertices):
    p = jamlab.jam(model="dp", n=3, seed=2, sizes=[3.0, 4.0, 5.0], vertices=vertices)
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
    made = jamlab.to_polygons(disks, delta=0.1)
    assert made.converged and made.n == 10
    assert jamlab.packing_fraction(made) == pytest.approx(jamlab.packing_fraction(disks), abs=2e-6)
    assert np.diff(jamlab.to_polygons(disks, delta=0.1, vertices=12).offsets).tolist() == [12] * 10


def test_outlines_make_the_droplets_that_they_came_from(droplets):
    """In another unit, wrapped into the box, and some of them clockwise."""
    shapes = np.split(3.0 * droplets.positions, droplets.offsets[1:-1])
    box = 3.0 * droplets.box
    shapes = [shape - np.floor(shape @ np.linalg.inv(box)) @ box for shape in shapes]
    shapes = [shape[::-1] if m % 2 else shape for m, shape in enumerate(shapes)]
    law = {name: value for name, value in droplets.params.items() if name != "a0"}
    p = jamlab.from_outlines(shapes, box, rest_areas=9.0 * droplets.params["a0"], **law)
    assert p.params["a0"] == pytest.approx(droplets.params["a0"], rel=1e-12)
    assert p.polygon_areas == pytest.approx(droplets.polygon_areas, rel=1e-10)
    assert jamlab.evaluate(p).energy == pytest.approx(jamlab.evaluate(droplets).energy, rel=1e-9)
    assert jamlab.from_outlines(shapes, box, **law).params["a0"].shape == (10,)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: jamlab.jam("dp", 3, sizes="lognormal:0.3", vertices=[8, 9]), r"vertices hold 2 numbers for n = 3"),
        (lambda: jamlab.jam("dp", 3, sizes="lognormal:0.3", vertices=2), r"cannot have 2 vertices: vertices are whole"),
        (lambda: jamlab.jam("dp", 3, sizes="lognormal:0.3", vertices=8.5), r"cannot have 8\.5 vertices"),
        (lambda: jamlab.jam("dp", 3, sizes=[1.0, 1.0]), r"sizes hold 2 diameters for n = 3"),
        (lambda: jamlab.jam("dp", 2, sizes=[1.0, 40.0]), r"line tension shrinks a free droplet to a point"),
        (lambda: jamlab.from_outlines([], [4.0, 4.0]), r"outlines: give one or more"),
        (lambda: jamlab.from_outlines([[[0, 0], [1, 0]]], [4.0, 4.0]), r"each of three vertices or more"),
        (lambda: jamlab.from_outlines([[[0, 0], [1, np.nan], [1, 1]]], [4.0, 4.0]), r"outlines\[0\]\[1, 1\] is nan"),
        (lambda: jamlab.from_outlines([[[0, 0], [1, 0], [2, 0]]], [9.0, 9.0]), r"rest_areas\[0\] is 0"),
        (lambda: jamlab.from_outlines([np.eye(3, 2)], [9.0, 9.0], weight=1.0), r"no parameter 'weight'"),
    ],
)
def test_what_is_no_droplet_is_one_line(call, message):
    with pytest.raises(jamlab.InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_a_campaign_of_droplets_of_any_sizes(tmp_path):
    file = written(tmp_path / "c.toml", model="dp", n=3, seeds=1, compress=None, onset=True, sizes=[1.0, 1.5, 2.0])
    (batch,) = batches(read_campaign_file(file))
    (packing,) = make_states(Parameters.read(batch.parameters.model_dump_json())).packings
    assert np.sqrt(packing.params["a0"]) == pytest.approx([2 / 3, 1.0, 4 / 3], rel=1e-12)
    assert packing.phi == jamlab.jam("dp", 3, 1, sizes=[1.0, 1.5, 2.0]).phi
    written(file, model="dp", n=3, seeds=1, compress=None, onset=True, force_law={"vertices": 12})
    with pytest.raises(jamlab.InputError, match=r"vertices are those of one packing: give nv_small and nv_large"):
        jamlab.open_campaign(file)


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


@pytest.mark.parametrize(
    "text", ["monodisperse,foo", "monodisperse:abc", "monodisperse:1", "uniform:1e-17", "gaussian:0"]
)
def test_words_and_widths_that_are_no_distribution_are_named(text):
    with pytest.raises(jamlab.InputError, match=text):
        SizeDistribution.of(text)
