"""What a page of the explorer holds: unpacked again, it is what the library computes."""

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
import shapely

import jamlab
from jamlab.figures.explorer import write_page as page
from jamlab.figures.explorer.states import (
    PAGES,
    displacements,
    observe,
    pack_state,
    shear_between,
    strains,
    unflipped_box,
)
from jamlab.packing.deformation import at_phi, sheared
from studies.reference_data import example_file

STATES = Path(__file__).parent / "states"
KINDS = {"pairs": "<u2", "image": "<i2", "bearing": "u1", "rattler": "u1", "z": "<u2", "sides": "<u2"}


@pytest.fixture(params=["disks", "droplets"])
def packing(request):
    """Stored states; the disks in the same lattice by a box that is tilted by its width."""
    stored = jamlab.read(STATES / f"{request.param}.h5")
    tilted = stored.box + np.outer([0.0, 1.0], stored.box[0])
    return stored.with_state(box=tilted) if request.param == "disks" else stored


def numbers(packed, name):
    return np.frombuffer(base64.b64decode(packed[name]), KINDS.get(name, "<f4"))


def points(text):
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, 2)


def lines(packed):
    ends = np.frombuffer(base64.b64decode(packed["ends"]), "<u4")
    return np.split(points(packed["points"]), ends[:-1])


def head(page):
    return json.loads(re.search(r'class="head">(.*?)</script>', page, re.DOTALL)[1])


def test_particles_lie_in_the_cell_and_keep_their_shape(packing):
    state = pack_state(packing, None)
    sites = points(state["sites"])
    moved = (sites - packing.positions) @ np.linalg.inv(packing.box)
    np.testing.assert_allclose(moved, np.round(moved), atol=1e-3)
    centres = points(state["centres"]) if "centres" in state else sites
    lattice = centres @ np.linalg.inv(packing.box)
    assert lattice.min() > -1e-3 and lattice.max() < 1 + 1e-3
    np.testing.assert_allclose(
        sites - centres[packing.particle], packing.positions - packing.centroids[packing.particle], atol=1e-5
    )


def test_contacts_join_particles_as_they_are_drawn(packing):
    state, network = pack_state(packing, None), jamlab.contacts(packing)
    packed, found = state["contacts"], network.forces
    (i, j), image = numbers(packed, "pairs").reshape(-1, 2).T, numbers(packed, "image").reshape(-1, 2)
    centres = points(state.get("centres", state["sites"]))
    np.testing.assert_allclose(centres[j] + image @ packing.box - centres[i], network.r, atol=1e-5)
    np.testing.assert_allclose(numbers(packed, "force"), found.size, rtol=1e-6)
    np.testing.assert_allclose(numbers(packed, "gap"), found.gap, rtol=1e-6)
    assert (numbers(packed, "bearing") == network.bearing).all()


def test_numbers_of_particles_are_those_of_the_library(packing):
    packed, network = pack_state(packing, None)["particles"], jamlab.contacts(packing)
    np.testing.assert_allclose(numbers(packed, "shape"), jamlab.shape_factors(packing), rtol=1e-6)
    np.testing.assert_allclose(numbers(packed, "area"), jamlab.particle_areas(packing), rtol=1e-6)
    np.testing.assert_allclose(numbers(packed, "cell"), jamlab.tessellation(packing).area, rtol=1e-6)
    assert (numbers(packed, "rattler") == network.rattlers).all()
    assert numbers(packed, "z")[~network.rattlers].mean() == pytest.approx(network.z)


def test_voids_have_their_size(packing):
    state, found = pack_state(packing, None), jamlab.voids(packing)
    packed, closed = state["voids"], found.percolating == 0
    rings = lines(packed)
    first = np.cumsum(numbers(packed, "rings").view("<u4")) - numbers(packed, "rings").view("<u4")
    areas = np.array([shapely.Polygon(rings[k]).area for k in first])
    solid, coarse = found.islands[closed] == 0, PAGES.coarse * np.sqrt(packing.area / packing.n)
    wrong = np.abs(areas - found.area[closed])[solid]
    assert (wrong <= coarse * found.perimeter[closed][solid]).all()  # boundaries are off by `coarse` at most
    assert (numbers(packed, "sides") == found.sides[closed]).all()


def test_walls_between_cells_have_their_length_and_part_the_particles(packing):
    """Walls are drawn once, in the cell; the two nearest disks of a point on one are equally far."""
    walls, cells = lines(pack_state(packing, None)["walls"]), jamlab.tessellation(packing)
    drawn = [shapely.LineString(wall) for wall in walls]
    assert sum(wall.length for wall in drawn) == pytest.approx(cells.wall_length.sum(), rel=0.01)
    middles = np.array([wall.interpolate(0.5, normalized=True).coords[0] for wall in drawn])
    inside = middles @ np.linalg.inv(packing.box)
    assert (np.abs(inside - 0.5) < 0.5 + 1e-3).all()
    if packing.diameters is not None:
        moved = middles[:, None] - packing.centroids
        moved -= np.round(moved @ np.linalg.inv(packing.box)) @ packing.box
        power = np.sort((moved**2).sum(axis=2) - packing.diameters**2 / 4, axis=1)
        np.testing.assert_allclose(power[:, 0], power[:, 1], atol=1e-5)


def test_outlines_that_cross_are_refused_with_the_number_of_the_state(tmp_path):
    packing = jamlab.read(STATES / "droplets.h5")
    onto_another = np.where(packing.particle == 0, 1.0, 0.0)[:, None] * (np.diff(packing.centroids[:2], axis=0) + 0.2)
    crossed = packing.with_state(positions=packing.positions + onto_another)
    with pytest.raises(jamlab.InputError, match=r"\b1\b"):
        jamlab.write_page(tmp_path / "page.html", [packing, crossed])


def test_displacements_leave_out_the_box_the_drift_and_jumps_by_a_period(packing):
    after = sheared(at_phi(packing, 0.99 * packing.phi), 0.02)
    np.testing.assert_allclose(displacements(packing, after), 0, atol=1e-12)
    own = np.where(packing.particle == 0, 1.0, 0.0)[:, None] * [0.03, -0.04]
    jump = np.where(packing.particle == 1, 1.0, 0.0)[:, None] * after.box[1]
    moved = displacements(packing, after.with_state(positions=after.positions + own + jump + [0.2, 0.1]))
    np.testing.assert_allclose(moved[0], [0.03, -0.04], atol=1e-12)
    np.testing.assert_allclose(moved[1:], 0, atol=1e-12)


def test_page_takes_known_numbers_measures_others_and_says_why_there_is_no_modulus(tmp_path):
    stored = jamlab.read(STATES / "droplets.h5")
    sweep = [stored, at_phi(stored, 0.7)]
    jamlab.write_page(tmp_path / "page.html", sweep, observables={"z": [4.25, np.nan], "psi": [1.0, 2.0]})
    content = head((tmp_path / "page.html").read_text())
    first, last = content["rows"]
    assert (first["z"], last["z"]) == (4.25, None)
    measured = jamlab.measure(stored, ["g", "pressure", "rho"])
    assert {name: first[name] for name in measured} == pytest.approx(measured)
    assert (first["why"], first["converged"], first["on_target"]) == ("", True, True)
    assert last["g"] is None and "0.7000" in last["why"] and last["converged"] is None
    assert content["along"]["name"] == "rho"
    assert "mean over directions" in content["curves"][1]["label"] and content["curves"][1]["unit"] == "ε/l²"


def test_page_is_one_file_and_takes_every_kth_state(tmp_path):
    stored = jamlab.read(STATES / "disks.h5")
    sweep = [sheared(stored, 0.01 * k) for k in range(7)]
    done = []
    jamlab.write_page(tmp_path / "page.html", iter(sweep), every=3, progress=lambda *told: done.append(told))
    page = (tmp_path / "page.html").read_text()
    assert not re.search(r"\b(src|href)=|url\(|@import|//[a-z]+\.[a-z]", page.replace("http://www.w3.org/2000/svg", ""))
    assert page.count('class="state">') == 3 and done == [(k / 3, f"state {k} of 3") for k in (1, 2, 3)]
    content = head(page)
    assert content["along"]["name"] == "strain"
    start = stored.box[1, 0] / stored.box[1, 1]
    assert [row["strain"] - start for row in content["rows"]] == pytest.approx([0.0, 0.03, 0.06])


@pytest.mark.parametrize("apart", [0.1, 0.8])
def test_strain_of_a_flow_goes_on_where_its_box_flips(tmp_path, apart):
    """Frames may be farther apart than the box leans at most, since each knows its strain."""
    start = jamlab.read(STATES / "disks.h5")
    run = jamlab.shear(start, 1.0, 8 * apart, snapshot_every=apart, rows=8)
    jamlab.write_page(tmp_path / "page.html", run.frames)
    content = head((tmp_path / "page.html").read_text())
    assert content["along"]["name"] == "strain"
    assert [row["strain"] for row in content["rows"]] == pytest.approx(apart * np.arange(9), abs=1e-9)


def test_a_flip_of_the_box_is_no_motion(packing):
    """The same lattice with another tilt, before and after a little shear; a lattice alone says it as well."""
    leans = sheared(packing, 0.5 * packing.box[0, 0] / packing.box[1, 1] - packing.box[1, 0] / packing.box[1, 1])
    after = sheared(leans, 0.02)
    flipped = after.with_state(box=after.box - [[0, 0], after.box[0]])
    assert shear_between(leans, flipped) == pytest.approx(0.02)
    np.testing.assert_allclose(unflipped_box(leans, flipped), after.box, atol=1e-12)
    np.testing.assert_allclose(displacements(leans, flipped), 0, atol=1e-11)
    assert strains([leans, flipped])[1] - strains([leans])[0] == pytest.approx(0.02)


def test_walls_that_are_compressed_are_not_sheared():
    """A box that leans by three widths leans by as much in units of length, while its height falls."""
    walled = jamlab.with_walls(jamlab.read(STATES / "disks.h5"), 1.4)
    leans = walled.with_state(box=walled.box + np.outer([0.0, 3.0], walled.box[0]))
    denser = at_phi(leans, 1.02 * leans.phi)
    assert shear_between(leans, denser) == pytest.approx(0.0, abs=1e-12)
    assert shear_between(leans, sheared(denser, 0.01)) == pytest.approx(0.01)
    np.testing.assert_allclose(unflipped_box(leans, denser), denser.box, atol=1e-12)


def test_what_does_not_belong_on_one_page_is_refused(tmp_path, monkeypatch):
    disks, droplets = (jamlab.read(STATES / f"{name}.h5") for name in ("disks", "droplets"))
    path = tmp_path / "page.html"
    other = disks.with_state(units="eps", params={"eps": 1.0})
    fewer = disks.select(np.arange(disks.n) > 0)
    larger = disks.with_state(diameters=1.01 * disks.diameters)
    for packings in ([], [disks, droplets], [disks, other], [disks, fewer], [disks, larger]):
        with pytest.raises(jamlab.InputError):
            jamlab.write_page(path, packings)
    for wrong in ({"every": 0}, {"observables": {"z": [1.0, 2.0]}}):
        with pytest.raises(jamlab.InputError):
            jamlab.write_page(path, disks, **wrong)
    with pytest.raises(jamlab.StorageError):
        jamlab.write_page(tmp_path / "absent" / "page.html", disks)
    monkeypatch.setattr(page, "PAGE_LIMITS", page.PageLimits(bytes=10_000))
    with pytest.raises(jamlab.InputError) as refused:
        jamlab.write_page(path, [disks] * 8)
    every = int(re.search(r"every=(\d+)", str(refused.value))[1])
    monkeypatch.setattr(page, "PAGE_LIMITS", page.PageLimits(23, 10_000 * 8 // every * every))  # what is proposed fits
    with pytest.raises(jamlab.InputError):
        jamlab.write_page(path, disks)
    assert not path.exists()


def test_a_modulus_below_zero_is_explained():
    packing = jamlab.read(example_file("sp"), frame=6)
    row = observe(packing, {}, 0.0)
    assert row["g"] < 0 and "shear-stabilized" in row["why"]
