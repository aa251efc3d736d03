"""Files of other programs: what they do not say is never guessed, what they say is read, the rest is named."""

import bz2
import gzip
import warnings

import numpy as np
import pytest

import jamlab
from jamlab.errors import InputError, JamlabWarning, StorageError

SIDE = 5.488688847349161
RNG = np.random.default_rng(3)
X = RNG.uniform(0, SIDE, (8, 2))
R = np.where(np.arange(8) % 2, 0.5833333333333334, 0.4166666666666667)
T = np.where(np.arange(8) % 2, 2, 1)
GIVEN = {"units": "k", "law": {"k": 1.0}}


def word(value):
    return f"{value:.17g}"


def data(path, rows, head="Atoms", tail="", types=2):
    lines = "\n".join(" ".join(map(str, row)) for row in rows)
    bounds = f"0 {word(SIDE)} xlo xhi\n0 {word(SIDE)} ylo yhi\n-0.5 0.5 zlo zhi"
    path.write_text(f"by hand\n\n{len(rows)} atoms\n{types} atom types\n{bounds}\n\n{head}\n\n{lines}\n{tail}")
    return path


BOUNDS = f"0 {word(SIDE)}\n0 {word(SIDE)}\n-0.5 0.5"


def frame(columns, rows, step=0, bounds=BOUNDS):
    lines = "".join(" ".join(map(str, row)) + "\n" for row in rows)
    head = f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{len(rows)}\nITEM: BOX BOUNDS pp pp pp\n{bounds}\n"
    return f"{head}ITEM: ATOMS {columns}\n{lines}"


def rows(*columns):
    """Rows of a file, each with its number first."""
    return [(k + 1, *(word(each[k]) if each.dtype.kind == "f" else each[k] for each in columns)) for k in range(8)]


X0, X1, ZERO = X[:, 0], X[:, 1], np.zeros(8, dtype=int)
PLAIN = rows(T, X0, X1, ZERO, R)


def same(p):
    assert (p.model, p.rounding) == ("sp", 0.0)
    assert np.array_equal(p.positions, X) and np.array_equal(p.diameters, 2 * R)


# LAMMPS data ----------------------------------------------------------------------------------------------------------

MOLECULES = np.arange(8) // 4 + 1
UNSAID = {
    "bpm/sphere": rows(ZERO + 1, T, 2 * R, ZERO + 1, X0, X1, ZERO),
    "line": rows(MOLECULES, T, ZERO, ZERO + 1, X0, X1, ZERO),
    "dipole": rows(T, ZERO.astype(float), X0, X1, ZERO, np.cos(X0), np.sin(X0), ZERO),
    "dipole of whole numbers": rows(T, ZERO, X0, X1, ZERO, ZERO, ZERO + 1, ZERO),
    "sphere": rows(T, 2 * R, ZERO + 1, X0, X1, ZERO),
    "atomic with images": rows(T, X0, X1, ZERO, ZERO, ZERO, ZERO),
    "molecular or charge": rows(MOLECULES, T, X0, X1, ZERO),
    "no type": rows(T + 5, X0, X1, ZERO),
}


@pytest.mark.parametrize("name", UNSAID)
def test_columns_without_a_style_are_not_guessed_but_taken_as_said(tmp_path, name):
    path = data(tmp_path / "p.data", UNSAID[name])
    for radii in ({"1": R[0], "2": R[1]}, 0.5, None):
        with pytest.raises(InputError, match="style"):
            jamlab.read(path, radii=radii, **GIVEN)
    if name in ("bpm/sphere", "sphere"):
        same(jamlab.read(path, atom_style=name, **GIVEN))


def test_five_and_six_columns_are_taken_where_only_one_style_fits(tmp_path):
    radii = {"1": R[0], "2": R[1]}
    for each in (rows(T, X0, X1, ZERO), rows(T, ZERO.astype(float) + 0.5, X0, X1, ZERO), rows(ZERO, T, X0, X1, ZERO)):
        same(jamlab.read(data(tmp_path / "p.data", each), radii=radii, **GIVEN))
    path = data(tmp_path / "p.data", UNSAID["molecular or charge"])
    same(jamlab.read(path, radii=radii, atom_style="molecular", **GIVEN))
    for style in ("atomic", "wedge"):
        with pytest.raises(InputError):
            jamlab.read(path, radii=radii, atom_style=style, **GIVEN)
    with pytest.raises(InputError, match="style"):
        jamlab.read(data(tmp_path / "p.data", UNSAID["sphere"], "Atoms # sphere"), atom_style="atomic")
    (tmp_path / "p.dump").write_text(frame("id type x y z radius", PLAIN))
    with pytest.raises(InputError, match="style"):
        jamlab.read(tmp_path / "p.dump", atom_style="sphere")


def test_spheres_that_image_counts_stack_are_not_flat(tmp_path):
    images = (*rows(T, X0, X1, ZERO),)
    stacked = [(*row, 0, 0, k % 2) for k, row in enumerate(images)]
    with pytest.raises(InputError, match="not flat"):
        jamlab.read(data(tmp_path / "p.data", stacked, "Atoms # atomic"), radii=0.5)
    level = [(*row, 0, 0, 1) for row in images]
    assert jamlab.read(data(tmp_path / "p.data", level, "Atoms # atomic"), radii=0.5).n == 8
    with pytest.raises(StorageError, match=r"ix of row 1 is 0\.5"):
        jamlab.read(data(tmp_path / "p.data", [(*row, 0.5, 0, 0) for row in images], "Atoms # atomic"), radii=0.5)


def test_whole_droplets_of_data_files_with_images_keep_their_long_edges(tmp_path):
    ring = np.array([[0.2, 0.2], [4.0, 0.2], [4.0, 1.2], [0.2, 1.2]])
    each = [(k + 1, 1, 1, *map(word, x), 0, 0, 0, 0) for k, x in enumerate(ring)]
    bonds = "\nBonds\n\n1 1 1 2\n2 1 2 3\n3 1 3 4\n4 1 4 1\n"
    p = jamlab.read(data(tmp_path / "p.data", each, "Atoms # molecular", bonds, 1), law={"a0": 3.8})
    assert p.polygons.areas == pytest.approx(3.8, rel=1e-14)
    same_bonds = jamlab.read(tmp_path / "p.data", model="sp", radii=0.3)  # bonded disks
    assert (same_bonds.model, same_bonds.n) == ("sp", 4)


# disks or droplets ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("molecule", [ZERO, ZERO + 1, MOLECULES, np.array([0, 1, 1, 1, 2, 2, 2, 0])])
def test_disks_may_have_molecules(tmp_path, molecule):
    (tmp_path / "p.dump").write_text(frame("id mol type x y z radius", rows(molecule, T, X0, X1, ZERO, R)))
    for given in ({}, GIVEN, {"model": "sp"}):
        same(jamlab.read(tmp_path / "p.dump", **given))
    (tmp_path / "p.dump").write_text(frame("id mol type x y z radius", rows(molecule, T, X0, X1, ZERO, 0 * R + 0.5)))
    for given in (GIVEN, {"model": "sp"}, *([{}] if not molecule.all() else [])):
        assert jamlab.read(tmp_path / "p.dump", **given).n == 8
    if molecule.all():
        with pytest.raises(InputError, match="model='sp'"):
            jamlab.read(tmp_path / "p.dump")
    for given in ({"model": "dp", "units": "k"}, {"model": "xy"}):
        with pytest.raises(InputError):
            jamlab.read(tmp_path / "p.dump", **given)


def test_parameters_of_droplets_given_for_disks_are_refused(tmp_path):
    (tmp_path / "p.dump").write_text(frame("id type x y z radius", PLAIN))
    with pytest.raises(InputError, match="a0"):
        jamlab.read(tmp_path / "p.dump", law={"a0": 1.0})


def test_columns_by_their_own_name_win(tmp_path):
    columns = "id type v_x v_y x y d_radius radius v_k v_eta v_gamma d_a0x v_id"
    each = rows(T, 0 * X0, 0 * X1, X0, X1, 9 * R, R, 0 * R + 7.5, R, R, R, R)
    (tmp_path / "p.dump").write_text(frame(columns, each))
    p = jamlab.read(tmp_path / "p.dump", units="k")
    same(p)
    assert p.params == {"k": 1.0} and p.provenance["assumed"] == ["k"]
    (tmp_path / "p.dump").write_text(frame("id type x y v_radius", rows(T, X0, X1, R)))
    same(jamlab.read(tmp_path / "p.dump"))


def test_the_points_of_a_contact_network_are_no_packing(tmp_path):
    p = jamlab.pack(n=8, pressure=1e-2, seed=1)
    points, _ = jamlab.write_contacts(tmp_path / "net.dump", p)
    with pytest.raises(InputError, match="contact network"):
        jamlab.read(points)


# ends that come too early ---------------------------------------------------------------------------------------------


def noticed(path, **given):
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        read = jamlab.read_all(path, **given)
    said = [each for each in seen if issubclass(each.category, JamlabWarning)]
    assert all(each.filename == __file__ for each in said)
    return read, said


@pytest.mark.parametrize(("column", "values"), [("Image", "12"), ("snapshot", "73"), ("image", ("a.png", "b.png"))])
def test_disks_of_several_pictures_are_several_states(tmp_path, column, values):
    rows = [f"{value},{k},{1 + 2 * k},{r}" for value, r in zip(values, (0.5, 0.7), strict=True) for k in range(3)]
    (tmp_path / "t.csv").write_text(f"{column},x,y,radius\n" + "\n".join(rows) + "\n")
    read = jamlab.read_all(tmp_path / "t.csv", box=[9, 9], **GIVEN)
    assert [(p.n, p.diameters[0]) for p in read] == [(3, 1.0), (3, 1.4)]


def test_a_file_of_jamlab_that_ends_within_its_last_line_is_not_read(tmp_path):
    """Each disk has its own diameter, in the last lines of a data file: 1.32 instead of 1.3246 is another packing."""
    rng = np.random.default_rng(1)
    p = jamlab.Packing("sp", 12 * np.eye(2), rng.random((70, 2)) * 12, {"k": 1.0}, "k", 1 + rng.random(70))
    for name in ("p.data", "p.dump", "p.xyz"):
        path = tmp_path / name
        jamlab.write(path, p)
        whole = path.read_bytes()
        for end in (1, 2, 4, 9, 20):
            path.write_bytes(whole[:-end])
            with pytest.raises(StorageError, match="cut off"):
                jamlab.read(path)


def test_a_data_file_that_holds_fewer_bonds_than_it_announces_is_cut_off(tmp_path):
    """The last droplet, without bonds, would be single disks."""
    rows = [(k + 1, k // 4 + 1, 1, 3 * (k // 4) + (k % 4 in (1, 2)), int(k % 4 > 1), 0) for k in range(8)]
    bonds = [f"{k + 1} 1 {k + 1} {4 * (k // 4) + (k + 1) % 4 + 1}" for k in range(8)]
    for held in (8, 4, 0):
        tail = "\nBonds\n\n" + "\n".join(bonds[:held]) + "\n" if held else ""
        path = data(tmp_path / "d.data", rows, "Atoms # bond", tail, types=1)
        path.write_text(path.read_text().replace("1 atom types", "8 bonds\n1 atom types"))
        if held == 8:
            assert jamlab.read(path, law={"a0": 1.0}).n == 2
        else:
            with pytest.raises(StorageError, match=f"announces 8 bonds and holds {held}"):
                jamlab.read(path, radii=0.5)


def test_frames_before_the_end_of_a_file_are_read_with_a_warning(tmp_path):
    """Wherever a dump of three frames ends: what is read is whole, and nothing is missing without a word."""
    whole = "".join(frame("id type x y z radius", PLAIN, step) for step in (0, 100, 200))
    one = len(whole) // 3
    path = tmp_path / "p.dump"
    for end in range(one + 20, len(whole), 37):
        path.write_text(whole[:end])
        read, said = noticed(path, **GIVEN)
        at_border = whole[:end].endswith("\n") and end % one <= 4
        assert len(read) in (end // one, end // one + 1) and (said or at_border or len(read) == end // one + 1)
        for p in read:
            same(p)
    for end in (one - 30, 60, 12):
        path.write_text(whole[:end])
        with pytest.raises(StorageError, match="cut off"):
            jamlab.read_all(path, **GIVEN)
    path.write_text(whole[: 2 * one + 200])
    assert jamlab.read(path, -1, **GIVEN).provenance["step"] == 100
    assert jamlab.read(path, -2, **GIVEN).provenance["step"] == 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        jamlab.read(path, 1, **GIVEN)
    with gzip.open(tmp_path / "p.dump.gz", "wt") as file:
        file.write(whole * 40)
    packed = (tmp_path / "p.dump.gz").read_bytes()
    (tmp_path / "p.dump.gz").write_bytes(packed[: len(packed) - 40])
    read, said = noticed(tmp_path / "p.dump.gz", **GIVEN)
    assert read and len(said) == 1


def test_the_last_number_of_a_dump_is_not_taken_where_it_lost_digits(tmp_path):
    whole = "".join(frame("id type x y z radius", PLAIN, step) for step in (0, 100))
    (tmp_path / "p.dump").write_text(whole[:-9])
    read, said = noticed(tmp_path / "p.dump", **GIVEN)
    assert (len(read), len(said)) == (1, 1)


def test_xyz_and_tables_that_end_within_a_frame(tmp_path):
    lines = "".join(f"A {word(x)} {word(y)} 0 {word(r)}\n" for (x, y), r in zip(X, R, strict=True))
    lattice = " ".join(map(word, [SIDE, 0, 0, 0, SIDE, 0, 0, 0, 1]))
    one = f'8\nLattice="{lattice}" Properties=species:S:1:pos:R:3:radius:R:1\n{lines}'
    for third in (one[:200], one[:-9]):  # a number of the last row has lost digits
        (tmp_path / "p.xyz").write_text(2 * one + third)
        read, said = noticed(tmp_path / "p.xyz", **GIVEN)
        assert (len(read), len(said)) == (2, 1)
    table = "frame,x,y,r\n" + "".join(
        f"{k},{word(x)},{word(y)},{word(r)}\n" for k in range(2) for (x, y), r in zip(X, R, strict=True)
    )
    for end in (-25, -9):
        (tmp_path / "p.csv").write_text(table[:end])
        read, said = noticed(tmp_path / "p.csv", box=[SIDE, SIDE], **GIVEN)
        assert (len(read), len(said)) == (1, 1)
        same(read[0])
    (tmp_path / "p.csv").write_text("x,y,r\n1,2,0.75\n3,4,0.5")  # by hand, without an end
    assert jamlab.read(tmp_path / "p.csv", box=[6, 6]).diameters.tolist() == [1.5, 1.0]


# tables ---------------------------------------------------------------------------------------------------------------


def table(path, head, *columns, order=range(8)):
    lines = [",".join(word(v) if isinstance(v, float) else str(v) for v in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([head, *(lines[k] for k in order)]) + "\n")
    return path


def test_tables_of_trackmate_imagej_fortran_and_with_notes(tmp_path):
    x, y, r = X0.tolist(), X1.tolist(), R.tolist()
    box, path = {"box": [SIDE, SIDE], **GIVEN}, tmp_path / "p.csv"
    same(
        jamlab.read(
            table(path, "LABEL,TRACK_ID,POSITION_X,POSITION_Y,FRAME,RADIUS", "abcdefgh", T, x, y, ZERO, r), **box
        )
    )
    more = "LABEL,POSITION_X,POSITION_Y,RADIUS\nLabel,X,Y,Radius\nLabel,X,Y,R\n,(micron),(micron),(micron)"
    same(jamlab.read(table(path, more, "abcdefgh", x, y, r), **box))
    found = jamlab.read(table(path, " ,Area,X,Y,Perim.", range(8), (np.pi * R**2).tolist(), x, y, r), **box)
    assert found.diameters == pytest.approx(2 * R, rel=1e-14) and "areas" in found.provenance["sizes"]
    same(jamlab.read(table(path, "# run 7, 12 May\n# x,y,r", x, y, r), **box))
    same(jamlab.read(table(path, '"x","y","r","a, b"', x, y, r, ['"1, 2"'] * 8), **box))
    fortran = [[f"{v:.16E}".replace("E", "D") for v in column] for column in (x, y, r)]
    same(jamlab.read(table(path, "x,y,r", *fortran), **box))
    twice = [*x, *x], [*y, *y], [*r, *r], [1] * 8 + [2] * 8
    for name in ("Slice", "FRAME", "ImageNumber", "POSITION_T [sec]"):
        same(jamlab.read(table(path, f"X,Y,r,{name}", *twice, order=range(16)), **box))
    with pytest.raises(InputError, match="differ in slice"):
        jamlab.read(table(path, "x,y,r,slice,frame", *twice, [0] * 16, order=range(16)), **box)
    path.write_text("x,y,r\n1,2,0.5\n1,b,0.5\n")
    with pytest.raises(StorageError, match="y of row 2: 'b' is no number"):
        jamlab.read(path, box=[4, 4])


def test_a_column_t_is_time_only_if_it_means_it(tmp_path):
    x, y, r, path = X0.tolist(), X1.tolist(), R.tolist(), tmp_path / "p.csv"
    box = {"box": [SIDE, SIDE], **GIVEN}
    same(jamlab.read(table(path, "x,y,r,t", x, y, r, T), **box))  # sizes go by it
    same(
        jamlab.read(table(path, "x,y,r,t,id", x, y, [0.5] * 8, MOLECULES, range(8)), **box).with_state(diameters=2 * R)
    )
    assert len(jamlab.read_all(table(path, "x,y,r,t", x, y, r, 0.25 * MOLECULES), **box)) == 2
    assert len(jamlab.read_all(table(path, "x,y,r,t [s]", x, y, r, MOLECULES), **box)) == 2
    assert len(jamlab.read_all(table(path, "x,y,r,t,particle", x, y, r, MOLECULES, np.arange(8) % 4), **box)) == 2
    sizes = {"radii": {"1": R[0], "2": R[1]}, **box}
    same(jamlab.read(table(path, "x,y,t,id", x, y, T, range(8)), **sizes))
    with pytest.raises(InputError, match="time or type"):
        jamlab.read(table(path, "x,y,r,t", x, y, [0.5] * 8, T), **box)
    same(jamlab.read(table(path, "x,y,r,t", x, y, r, ["ab"[t - 1] for t in T]), **box))


@pytest.mark.parametrize("kind", ["csv", "xyz"])
def test_particles_are_the_same_in_all_frames(tmp_path, kind):
    orders = [RNG.permutation(8), np.arange(8)[::-1]]
    lattice = " ".join(map(word, [SIDE, 0, 0, 0, SIDE, 0, 0, 0, 1]))
    text = "frame,particle,x,y,r\n" if kind == "csv" else ""
    for k, order in enumerate(orders):
        if kind == "xyz":
            text += f'8\nLattice="{lattice}" Properties=id:I:1:pos:R:2:radius:R:1\n'
        for m in order:
            each = [*([k] if kind == "csv" else []), m + 1, *map(word, (*X[m], R[m]))]
            text += (" " if kind == "xyz" else ",").join(map(str, each)) + "\n"
    (tmp_path / f"p.{kind}").write_text(text)
    given = {**GIVEN, **({"box": [SIDE, SIDE]} if kind == "csv" else {})}
    for p in jamlab.read_all(tmp_path / f"p.{kind}", **given):
        same(p)
    (tmp_path / f"p.{kind}").write_text(text.replace("\n1 ", "\n2 ").replace("0,1,", "0,2,"))
    with pytest.raises(InputError, match=r"(id|particle) 2 stands on 2 rows"):
        jamlab.read_all(tmp_path / f"p.{kind}", **given)


# boxes and kinds ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lattice", "error"),
    [
        ("{L} 0 0.5 {L}", None),
        ("0.5 {L} 0 {L} 0 0 0 0 1", None),
        ("{L} 0 0 0.5 -{L} 0 0 0 1", None),
        ("5 2 0 -2 5 0 0 0 1", "-21.80140949 degrees"),
        ("{L} 0 0 0 {L} 0 0.5 0 1", "not planar"),
        ("{L} 0 0.1 0 {L} 0 0 0 1", "not planar"),
        ("{L} 0 0 1 2 3", "6 numbers"),
    ],
)
def test_lattices_of_xyz(tmp_path, lattice, error):
    lines = "".join(f"A {word(x)} {word(y)} 0 {word(r)}\n" for (x, y), r in zip(X, R, strict=True))
    lattice = lattice.replace("{L}", word(SIDE))
    (tmp_path / "p.xyz").write_text(f'8\nLattice="{lattice}" Properties=species:S:1:pos:R:3:radius:R:1\n{lines}')
    if error is None:
        p = jamlab.read(tmp_path / "p.xyz", **GIVEN)
        same(p)
        assert p.area == pytest.approx(SIDE**2) and p.box[0].tolist() == [SIDE, 0.0]
    else:
        with pytest.raises((InputError, StorageError), match=error):
            jamlab.read(tmp_path / "p.xyz", **GIVEN)


def test_bounds_the_wrong_way_round_are_named(tmp_path):
    (tmp_path / "p.dump").write_text(frame("id type x y z radius", PLAIN, 0, "5 0\n0 5\n-0.5 0.5"))
    with pytest.raises(InputError, match="from 5 to 0 along x"):
        jamlab.read(tmp_path / "p.dump")


KINDS = {
    "a.dump.zst": (b"\x28\xb5\x2f\xfd" + bytes(40), "zstd"),
    "dump.zst": (b"\x28\xb5\x2f\xfd" + bytes(40), "zstd"),
    "dump.1": (gzip.compress(b"ITEM: TIMESTEP\n"), "ending .gz"),
    "dump.yaml": (b"---\ncreator: LAMMPS\n", "YAML"),
    "a.dump": (b"\xff\xfeI\0T\0E\0M\0", "UTF-16"),
    "b.dump": (b"\xf6\xff\xff\xff\xff\xff\xff\xffDUMPCUSTOM\1\0\0\0", "binary dump"),
    "dump.2": (bz2.compress(b"ITEM: TIMESTEP\n"), "ending .bz2"),
    "a.npz": (b"PK\x03\x04" + bytes(30), "zip archive"),
    "entries.dump": (b"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ENTRIES\n1\n", "not of atoms"),
}


@pytest.mark.parametrize("name", KINDS)
def test_other_kinds_of_files_are_named(tmp_path, name):
    content, said = KINDS[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises((StorageError, InputError), match=said) as caught:
        jamlab.read(tmp_path / name)
    assert "damaged" not in str(caught.value)


def test_sizes_of_hoomd_may_stand_in_its_shapes(tmp_path):
    hoomd = pytest.importorskip("gsd.hoomd")
    made = hoomd.Frame()
    made.particles.N, made.particles.position = 8, np.column_stack([X - SIDE / 2, ZERO])
    made.particles.types, made.particles.typeid = ["A", "B"], T - 1
    made.particles.type_shapes = [{"type": "Sphere", "diameter": 2 * R[0]}, {"type": "Ellipsoid", "a": R[1], "b": R[1]}]
    made.configuration.box, made.configuration.dimensions = [SIDE, SIDE, 1, 0, 0, 0], 2
    with hoomd.open(tmp_path / "p.gsd", "w") as file:
        file.append(made)
    assert jamlab.read(tmp_path / "p.gsd").diameters == pytest.approx(2 * R, rel=1e-6)
    made.bonds.N, made.bonds.types, made.bonds.typeid, made.bonds.group = 1, ["b"], [0], [(0, 1)]
    with hoomd.open(tmp_path / "p.gsd", "w") as file:
        file.append(made)
    with pytest.raises(InputError, match="model='sp'"):
        jamlab.read(tmp_path / "p.gsd")
    assert jamlab.read(tmp_path / "p.gsd", model="sp").diameters == pytest.approx(2 * R, rel=1e-6)
    made.particles.typeid = T + 1
    with hoomd.open(tmp_path / "p.gsd", "w") as file:
        file.append(made)
    with pytest.raises(InputError, match="typeid"):
        jamlab.read(tmp_path / "p.gsd")
