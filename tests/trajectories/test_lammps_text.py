"""Data files and dumps back into packings: what jamlab writes to all digits, what others write as far as it goes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from wandering_packings import assert_same, disks, polygons

import jamlab
from jamlab.errors import InputError, StorageError
from jamlab.packing.lammps_files import wrap

TILTS = [0.0, 1 / 3, -1.1, 16 / 3]
ANY = {"seed": st.integers(0, 10**6), "tilt": st.sampled_from(TILTS)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("text")


@pytest.mark.parametrize("make", [disks, lambda seed, tilt: disks(seed, tilt, "k"), polygons])
@pytest.mark.parametrize("suffix", ["data", "dump"])
@given(**ANY)
def test_nothing_is_lost_on_the_way_through_a_file(folder, make, suffix, seed, tilt):
    packing = make(seed, tilt)
    path = folder / f"p.{suffix}"
    if suffix == "data":
        jamlab.write(path, packing)
    else:
        jamlab.write(path, [make(seed, 0.0), packing])
    read = jamlab.read(path)
    assert_same(read, packing, 15)
    assert (read.max_force, read.converged, read.rounding) == (packing.max_force, packing.converged, 0.0)
    if suffix == "dump":
        assert read.positions.tobytes() == packing.positions.tobytes()
        assert [len(jamlab.read_all(path)), jamlab.read(path, 0).box[1, 0]] == [2, 0.0]


@pytest.mark.parametrize("make", [disks, polygons])
def test_a_minimum_stays_one_but_a_rounded_packing_never_becomes_one(tmp_path, make):
    packing = replace(make(1, 0.3), converged=True, max_force=1e-12)
    jamlab.write(tmp_path / "p.data", packing)
    jamlab.write(tmp_path / "p.dump", [packing])
    for name in ("p.data", "p.dump"):
        assert jamlab.read(tmp_path / name).converged
    rounded = jamlab.from_universe(jamlab.universe(packing))[0]
    jamlab.write(tmp_path / "p.data", rounded)
    jamlab.write(tmp_path / "p.dump", [rounded])
    for name in ("p.data", "p.dump"):
        read = jamlab.read(tmp_path / name)
        assert read.rounding == rounded.rounding > 0
        assert (read.converged, read.max_force) == (False, None)


LAMMPS = """LAMMPS data file via write_data, units = lj

{count} atoms
{types} atom types

2.5 6.5 xlo xhi
-1 3 ylo yhi
-0.5 0.5 zlo zhi
0.5 0 0 xy xz yz

Masses

1 1

Atoms # {style}

{rows}
"""


def data_file(path, style, rows, tail="", types=2):
    path.write_text(LAMMPS.format(count=len(rows), types=types, style=style, rows="\n".join(rows)) + tail)
    return path


@pytest.mark.parametrize(
    ("style", "columns"),
    [
        ("atomic", "{i} {t} {x} {y} 0"),
        ("charge", "{i} {t} 0.0 {x} {y} 0"),
        ("molecular", "{i} 1 {t} {x} {y} 0 1 -1 0"),
        ("full", "{i} 0 {t} 0.0 {x} {y} 0"),
        ("sphere", "{i} {t} {d} 1.0 {x} {y} 0 0 0 0"),
    ],
)
def test_atom_styles_of_other_programs(tmp_path, style, columns):
    xy, types = [(3.123456789012345, 0.25), (5.0, 2.75), (4.0, 1.0)], [2, 1, 2]
    rows = [columns.format(i=i, t=t, x=x, y=y, d=t / 3) for i, t, (x, y) in zip((3, 1, 2), types, xy, strict=True)]
    path = data_file(tmp_path / "p.data", style, rows)
    read = jamlab.read(path, radii=None if style == "sphere" else {1: 1 / 6, 2: 1 / 3})
    assert read.box.tolist() == [[4.0, 0.0], [0.5, 4.0]]
    shift = np.array([1.0, -1.0]) @ read.box if style == "molecular" else 0.0
    np.testing.assert_allclose(read.positions, np.array([xy[1], xy[2], xy[0]]) - [2.5, -1] + shift, rtol=1e-15)
    assert read.diameters.tolist() == pytest.approx([1 / 3, 2 / 3, 2 / 3])
    assert read.provenance == {"source": "p.data", "assumed": ["eps"]}


def test_what_a_file_does_not_say_comes_from_the_decks_or_the_user(tmp_path):
    path = data_file(tmp_path / "p.data", "atomic", ["1 1 3.123456789012345 0.2 0", "2 2 4.5 1.5 0"])
    with pytest.raises(InputError):
        jamlab.read(path)
    assert jamlab.read(path, radii=0.5).provenance["assumed"] == ["eps"]
    read = jamlab.read(path, units="k", law={"k": 3.0}, radii=0.5)
    assert (read.units, read.params, read.diameters.tolist()) == ("k", {"k": 3.0}, [1.0, 1.0])
    assert "assumed" not in read.provenance
    with pytest.raises(InputError):
        jamlab.read(path, radii={"1": 0.5})
    with pytest.raises(InputError):
        jamlab.read(path, law={"gamma": 1.0})


@pytest.mark.parametrize("make", [disks, polygons])
def test_values_that_differ_from_those_of_the_file_are_refused(tmp_path, make):
    packing = make(1, 0.0)
    jamlab.write(tmp_path / "p.data", packing)
    jamlab.write(tmp_path / "p.dump", [packing])
    for path in (tmp_path / "p.data", tmp_path / "p.dump"):
        for other in ({"law": {"eps": 7.0}}, {"units": "k"}, {"radii": 9.0} if make is disks else {"radii": 1.0}):
            with pytest.raises(InputError):
                jamlab.read(path, **other)
        assert jamlab.read(path, law={"eps": packing.params["eps"]}, units="eps").difference(packing) is None


DUMP = """ITEM: TIMESTEP
{step}
ITEM: NUMBER OF ATOMS
3
ITEM: BOX BOUNDS{tilt} pp pp pp
2 6.5{xy}
-1 3{zero}
-0.5 0.5{zero}
ITEM: ATOMS {columns}
{rows}
"""


@pytest.mark.parametrize("names", ["x y", "xu yu", "xs ys", "xsu ysu", "x y ix iy"])
@pytest.mark.parametrize("tilt", [-0.5, 0.0])
def test_coordinates_of_dumps(tmp_path, names, tilt):
    box = np.array([[4.5 - abs(tilt), 0.0], [tilt, 4.0]])
    low = np.array([2 - min(0, tilt), -1])
    fraction = np.array([[0.123456789012345, 0.2], [0.5, 0.625], [0.25, 0.75]])
    images = np.array([[1, 0], [0, -2], [0, 0]]) * ("i" in names)
    read = fraction if "s" in names else fraction @ box + low
    shown = [
        " ".join([str(i), "1", *(f"{v:.17g}" for v in xy), *(str(k) for k in image[: 2 * ("i" in names)])])
        for i, xy, image in zip((2, 3, 1), read, images, strict=True)
    ]
    fields = {"tilt": " xy xz yz", "xy": f" {tilt}", "zero": " 0"} if tilt else {"tilt": "", "xy": "", "zero": ""}
    frame = DUMP.format(step=5, columns=f"id type {names}", rows="\n".join(shown), **fields)
    (tmp_path / "p.dump").write_text(frame)
    found = jamlab.read(tmp_path / "p.dump", radii=0.5)
    want = ((fraction + images) @ box)[[2, 0, 1]]
    np.testing.assert_allclose(found.positions, want, rtol=0, atol=4e-15)
    assert found.box.tolist() == box.tolist()
    assert (found.provenance["step"], found.rounding) == (5, 0.0)


@pytest.mark.parametrize("tilt", [1 / 3, 16 / 3])
def test_wrapped_droplets_become_whole(tmp_path, tilt):
    """As the decks' dumps had them: x and y in the box, no bonds, rows in any order."""
    packing = polygons(4, tilt)
    inside, image = wrap(packing)
    assert len(np.unique(image, axis=0)) > 4
    places, box = zip(packing.particle, inside, strict=True), packing.box
    rows = [f"{i + 1} {m + 1} {x:.17g} {y:.17g}" for i, (m, (x, y)) in enumerate(places)]
    text = DUMP.replace("\n3\n", f"\n{len(rows)}\n").replace("-1 3", f"0 {box[1, 1]:.17g}")
    text = text.replace("2 6.5{xy}", f"0 {box[0, 0] + box[1, 0]:.17g} {box[1, 0]:.17g}")
    fields = {"step": 0, "columns": "id mol x y", "tilt": " xy xz yz", "zero": " 0", "rows": "\n".join(rows[::-1])}
    (tmp_path / "p.dump").write_text(text.format(**fields))
    read = jamlab.read(tmp_path / "p.dump", law=packing.params)
    assert read.difference(packing) is None
    np.testing.assert_allclose(read.polygons.edges, packing.polygons.edges, rtol=0, atol=1e-14)
    apart = (read.positions - packing.positions) @ np.linalg.inv(box)
    np.testing.assert_allclose(apart, np.rint(apart), rtol=0, atol=1e-13)
    with pytest.raises(InputError):
        jamlab.read(tmp_path / "p.dump")


def test_missing_files_and_frames_are_named(tmp_path):
    with pytest.raises(StorageError):
        jamlab.read(tmp_path / "absent.dump")
    jamlab.write(tmp_path / "p.dump", [disks(0, 0.0)])
    for frame in (1, -2):
        with pytest.raises(StorageError):
            jamlab.read(tmp_path / "p.dump", frame)
    with pytest.raises(InputError):
        jamlab.read(tmp_path / "p.dump", True)
    jamlab.write(tmp_path / "p.h5", disks(0, 0.0))
    with pytest.raises(InputError):
        jamlab.read(tmp_path / "p.h5", radii=0.5)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("0.5 0 0 xy", "0.5 0.1 0 xy"),
        ("Atoms # atomic", "Atoms # ellipsoid"),
        ("0.5 0 0 xy xz yz", "1 0 0 avec"),
        ("Atoms # atomic", "Atoms # bond"),
    ],
)
def test_boxes_and_styles_that_are_no_packings_are_refused(tmp_path, old, new):
    path = data_file(tmp_path / "p.data", "atomic", ["1 1 3 0.2 0", "2 2 4.5 1.5 0"])
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError):
        jamlab.read(path)


def test_bonds_that_close_no_ring_are_refused(tmp_path):
    rows = [f"{i} 1 1 {3 + 0.1 * i} {0.2 * i * i} 0" for i in (1, 2, 3)]
    path = data_file(tmp_path / "p.data", "molecular", rows, "\nBonds\n\n1 1 1 2\n2 1 2 3\n")
    with pytest.raises(InputError):
        jamlab.read(path, law={"a0": 0.1})
    path.write_text(path.read_text() + "3 1 3 1\n")
    read = jamlab.read(path, law={"a0": 0.1})
    assert read.n == 1 and read.polygons.areas[0] > 0
