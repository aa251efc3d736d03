"""Packings of other groups: what they say of themselves is what jamlab finds; extended xyz."""

import json
import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from published_packings import read_goodrich, read_leiden

import jamlab
from jamlab.engine.deck_defaults import defaults
from jamlab.protocols.box_relaxation import minimizer
from jamlab.protocols.makings import making_of
from jamlab.protocols.onset_search import OnsetSearch, OnsetWork

PUBLISHED = Path(__file__).parents[1] / "states" / "published"
LEIDEN, SHEAR = PUBLISHED / "N16~P1e-3~0001.txt", PUBLISHED / "particlesN16~P1e-3~SR003~step007~0001.txt"
DATA = PUBLISHED / "dataN16~P1e-3~SR003~step007~0001.txt"
GOODRICH = sorted(PUBLISHED.glob("2d_*.nc"))


def test_leiden_packing_is_the_minimum_that_its_log_describes():
    p = read_leiden(LEIDEN)[0]
    e = jamlab.evaluate(p)
    assert (p.n, p.units, p.ensemble, p.rounding) == (16, "k", "shear-stabilized", 0.0)
    assert p.phi == pytest.approx(0.81494906634508249081, rel=1e-14)  # of logN16~P1e-3~0001.txt, as what follows
    assert e.energy == pytest.approx(1.0928358570711133750e-04, rel=1e-11)
    assert np.abs(e.forces).max() < 1e-14 and jamlab.contacts(p).z == 4.125
    assert e.stress == pytest.approx(1e-3 * np.eye(2), abs=1e-14)


@pytest.fixture(scope="module")
def sheared():
    """Their seven states, and the rows of their log by column; a pressure is positive here, their s is a pull."""
    lines = (PUBLISHED / "logN16~P1e-3~SR003~step007~0001.txt").read_text().splitlines()
    heading, *rows = [line.split() for line in lines if line[0] != "#"]
    columns = np.array([row[:17] for row in rows], dtype=float).T
    return read_leiden(SHEAR), dict(zip(heading, columns, strict=False))


def test_all_leiden_states_of_a_shear_through_a_contact_change(sheared):
    states, log = sheared
    contacts = [int(line.split()[2]) for line in DATA.read_text().splitlines() if line[0] not in "#g"]
    assert len(states) == len(log["U"]) == len(contacts) == 7 and set(contacts) == {32, 33}
    for k, p in enumerate(states):
        e, network = jamlab.evaluate(p), jamlab.contacts(p)
        assert e.energy == pytest.approx(log["U"][k], rel=1e-11)
        assert p.phi == pytest.approx(log["phi"][k], rel=1e-14)
        found = [e.pressure, -e.stress[0, 0], -e.stress[1, 1], -e.stress[0, 1]]
        assert found == pytest.approx([log[name][k] for name in ("P", "s_xx", "s_yy", "s_xy")], abs=1e-14)
        assert (network.z, network.rattlers.sum()) == (log["Z"][k], log["#rattler"][k])
        assert len(network.pairs) == contacts[k]


def test_elastic_tensors_are_the_slopes_of_the_leiden_stress(sheared):
    states, log = sheared
    strain = log["alpha"] * log["L"] / states[0].box[1, 1]  # tilt over height
    tensors = [jamlab.elastic_tensor(p).relaxed for p in states]
    for k in range(5):  # then a contact goes
        c = 0.5 * (tensors[k] + tensors[k + 1])[..., 0, 1]
        slopes = [np.diff(log[name])[k] / np.diff(strain)[k] for name in ("s_xx", "s_yy", "s_xy")]
        turned = log["s_xy"][k : k + 2].mean()  # sheared rows carry their tension along
        assert slopes == pytest.approx([c[0, 0] + turned, c[1, 1], c[0, 1]], abs=1e-8)


@pytest.mark.parametrize(
    "path", [GOODRICH[0], *(pytest.param(p, marks=pytest.mark.slow) for p in GOODRICH[1:])], ids=lambda path: path.stem
)
@pytest.mark.slow
def test_goodrich_energies_stresses_and_elastic_tensors(path):
    packings = read_goodrich(path)
    with h5py.File(path) as file:
        energy, stress, tensor = (file[name][()] for name in ("Energy", "Stress", "Cijkl"))
    assert len(packings) == 10
    for k, p in enumerate(packings):
        e, c = jamlab.evaluate(p), jamlab.elastic_tensor(p).relaxed
        assert e.energy == pytest.approx(energy[k], rel=1e-11)
        assert -e.stress == pytest.approx(stress[k].reshape(2, 2), abs=1e-12)
        strain = 0.25 * (c + c.transpose(1, 0, 2, 3) + c.transpose(0, 1, 3, 2) + c.transpose(1, 0, 3, 2))
        found = [strain[i] for i in ((0,) * 4, (1,) * 4, (0, 1, 0, 1), (0, 0, 1, 1), (0, 0, 0, 1), (1, 1, 0, 1))]
        assert found == pytest.approx(tensor[k], abs=1e-7)


SQUARE = 'Lattice="4 0 0 0 4 0 0 0 4"'
FOUR = [f"A {x} {y} 0 0.9" for x in (1.0, 3.0) for y in (1.0, 3.0)]


def read_one_xyz(path, comment, rows=FOUR, properties="species:S:1:pos:R:3:radius:R:1", box=SQUARE):
    path.write_text("\n".join([str(len(rows)), f"{box} Properties={properties} {comment}", *rows]) + "\n")
    return jamlab.read(path)


@pytest.mark.parametrize(
    "comment, units, params",
    [
        ("k=2.0", "k", {"k": 2.0}),
        ("eps=1.5 exponent=2.5", "eps", {"eps": 1.5, "exponent": 2.5}),
        ("exponent=3", "eps", {"eps": 1.0, "exponent": 3.0}),
        ('units=k k=0.5 pbc="T T F"', "k", {"k": 0.5}),
    ],
)
def test_the_law_in_the_comment_of_an_xyz_is_taken(tmp_path, comment, units, params):
    p = read_one_xyz(tmp_path / "p.xyz", comment)
    assert (p.units, p.params) == (units, params)
    assert p.provenance.get("assumed", []) == ([] if set(params) <= set(re.findall(r"\w+", comment)) else ["eps"])


def test_what_an_xyz_has_besides_is_passed_over(tmp_path):
    rows = [f"{row} 1.8 0 0 0 7" for row in FOUR]
    properties = "species:S:1:pos:R:3:Radius:R:1:diameter:R:1:vel:R:3:mu:R:1"
    p = read_one_xyz(tmp_path / "p.xyz", 'alpha=2 made by="some code"', rows, properties)
    assert p.provenance["assumed"] == ["eps"] and p.diameters.tolist() == [1.8] * 4


def test_three_dimensions_or_an_open_box_are_no_packing(tmp_path):
    cube = [f"A {x} {y} {z} 0.9" for x in (1.0, 3.0) for y in (1.0, 3.0) for z in (1.0, 3.0)]
    wrong = [row.replace(" 0.9", " 0.9 1.7") for row in FOUR]
    for given in (
        {"comment": "", "rows": cube},
        {"comment": 'pbc="F F F"'},
        {"comment": "units=eps k=1"},
        {"comment": "k=1 eps=1"},
        {"comment": "", "rows": wrong, "properties": "species:S:1:pos:R:3:radius:R:1:diameter:R:1"},
    ):
        with pytest.raises(jamlab.InputError):
            read_one_xyz(tmp_path / "p.xyz", **given)


TORUS = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
MAXIMA = json.loads((PUBLISHED / "hard_disk_crits_maxima.json").read_text())


@pytest.mark.parametrize("tolerance", [1e-7, 1e-3])  # of the distances, over the diameter
def test_all_24_catalogued_maxima_of_hard_disks_have_their_contacts(tolerance):
    assert len(MAXIMA) == 24
    for known in MAXIMA:
        diameters = np.full(known["n"], 2 * known["radius"] * (1 + tolerance))
        found = jamlab.contacts(jamlab.Packing("sp", TORUS, known["positions"], {"k": 1.0}, "k", diameters))
        pairs, count = np.unique(np.sort(found.pairs, axis=1), axis=0, return_counts=True)
        assert np.column_stack([pairs, count]).tolist() == sorted(known["contacts"])
        assert found.rattlers.sum() == known["rattlers"]


MORE = [(4, 1), (5, 1), (6, 1), (7, 1), (8, 2)]


@pytest.mark.parametrize(
    ("n", "seed"), [(3, 1), (8, 1), *(pytest.param(*each, marks=pytest.mark.slow) for each in MORE)]
)
def test_few_equal_disks_land_where_the_catalogue_has_a_maximum(n, seed):
    side = np.sqrt(n * np.pi / 4 / 0.2 / np.linalg.det(TORUS))
    start = side * np.random.default_rng(seed).random((n, 2)) @ TORUS
    loose = jamlab.Packing("sp", side * TORUS, start, {"eps": 1.0}, diameters=np.ones(n))
    with jamlab.Session(loose) as session:
        protocol = {name: float(value) for name, value in defaults("onset").items()}
        search = OnsetSearch(session, protocol, minimizer("fixed-box"), 1e-12, OnsetWork(making_of("sp").way, None))
        onset = search.by_bisection(loose, protocol["search_step"]).packing
    radius = pytest.approx(0.5 / onset.box[0, 0], rel=1e-6)
    landed = [known for known in MAXIMA if known["n"] == n and known["radius"] == radius]
    assert len(landed) == 1
    assert len(jamlab.contacts(onset).pairs) == sum(count for *_, count in landed[0]["contacts"])
