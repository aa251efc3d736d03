"""Disks in tables and compressed text of other programs: every number arrives."""

import bz2
import gzip
import lzma
import warnings

import numpy as np
import pytest

import jamlab
from jamlab.errors import InputError, StorageError

RNG = np.random.default_rng(5)
BOX = np.array([[4.123456789012345, 0.0], [0.512345678901234, 5.123456789012345]])
POSITIONS, RADII = RNG.uniform(0, 5, (6, 2)), RNG.uniform(0.3, 0.5, 6)


def same(p, box=BOX):
    assert np.array_equal(p.positions, POSITIONS) and np.array_equal(p.diameters, 2 * RADII)
    assert np.array_equal(p.box, box) and p.rounding == 0.0


@pytest.mark.parametrize(
    ("head", "more"),
    [
        ("x,y,radius", []),
        ("x;y;R", []),
        ("X\tY\tdiameter", []),
        ("x y d", []),
        ("# x y r", []),
        ('"x [px]","y [px]","Radius (px)"', []),
        ("\ufeffx,y,r", []),
        ("x,y,r,d,z,score", [1.0, 0.0, 0.5]),
        (",x,y,r", []),
    ],
)
def test_tables_with_any_head_and_separator(tmp_path, head, more):
    separator = next((mark for mark in ";\t," if mark in head), " ")
    lines = [head]
    for k, ((x, y), r) in enumerate(zip(POSITIONS, RADII, strict=True)):
        size = 2 * r if head.endswith(("d", "diameter")) else r
        values = [x, y, size, *([2 * r, *more[1:]] if more else [])]
        words = [f"{value:.17g}" for value in values]
        lines.append(separator.join([str(k), *words] if head[0] == "," else words))
    text = "\n".join(lines) + "\n"
    (tmp_path / "disks.csv").write_text(text.replace(".", ",") if separator == ";" else text, encoding="utf-8")
    same(jamlab.read(tmp_path / "disks.csv", box=BOX, units="k"))


def test_a_table_may_hold_frames_and_types_and_lack_sizes(tmp_path):
    rows = [f"{x:.17g},{y:.17g},{'BA'[k % 2]},{f}" for f in (3, 7) for k, (x, y) in enumerate(POSITIONS + f)]
    (tmp_path / "disks.csv").write_text("\n".join(["x,y,type,frame", *rows]))
    read = jamlab.read_all(tmp_path / "disks.csv", box=[4, 5], radii={"A": 0.2, "B": 0.3})
    for p, f in zip(read, (3, 7), strict=True):
        assert np.array_equal(p.positions, POSITIONS + f) and p.diameters.tolist() == [0.6, 0.4] * 3


def written(folder, kind, **digits):
    """The disks in a text file of another program, with so many digits of position, radius or box."""

    def words(name, values):
        return [f"{value:.{digits.get(name, 17)}g}" for value in np.ravel(values)]

    (x, y), r = np.reshape(words("position", POSITIONS), (6, 2)).T, words("radius", RADII)
    (lx, _), (xy, ly) = np.reshape(words("box", BOX), (2, 2))
    (wide,), d = words("box", BOX[0, 0] + BOX[1, 0]), words("radius", 2 * RADII)
    heads = {
        "csv": "x y r\n",
        "xyz": f'6\nLattice="{lx} 0 0 {xy} {ly} 0 0 0 1" Properties=pos:R:2:radius:R:1 k=2\n',
        "dump": "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n6\nITEM: BOX BOUNDS xy xz yz pp pp pp\n"
        f"0 {wide} {xy}\n0 {ly} 0\n-0.5 0.5 0\nITEM: ATOMS id x y radius\n",
        "data": f"\n6 atoms\n1 atom types\n0 {lx} xlo xhi\n0 {ly} ylo yhi\n-0.5 0.5 zlo zhi\n{xy} 0 0 xy xz yz\n\n"
        "Atoms # sphere\n\n",
    }
    rows = {"csv": "{x} {y} {r}", "xyz": "{x} {y} {r}"}
    rows |= {"dump": "{i} {x} {y} {r}", "data": "{i} 1 {d} 1.0 {x} {y} 0"}
    body = [rows[kind].format(i=k + 1, x=x[k], y=y[k], r=r[k], d=d[k]) for k in range(6)]
    path = folder / f"disks.{kind}"
    path.write_text(heads[kind] + "\n".join(body) + "\n")
    return path


TEXTS = ("csv", "xyz", "dump", "data")


@pytest.mark.parametrize("part", ["position", "radius", "box"])
@pytest.mark.parametrize("kind", TEXTS)
def test_all_digits_arrive_and_few_are_noticed(tmp_path, kind, part):
    given = {"box": BOX} if kind == "csv" else {}
    same(jamlab.read(written(tmp_path, kind), **given))
    p = jamlab.read(written(tmp_path, kind, **{part: 6}), **given)
    largest = {"position": POSITIONS, "radius": RADII, "box": BOX}[part].max()
    if (kind, part) != ("csv", "box"):
        assert 0.2 < p.rounding / 10.0 ** (np.floor(np.log10(largest)) - 5) < 1.1 and not p.converged


@pytest.mark.parametrize("opener", [gzip.open, bz2.open, lzma.open])
def test_compressed_text_is_read_and_damage_to_it_is_named(tmp_path, opener):
    p, ending = jamlab.pack(n=8, pressure=1e-2, seed=1), {gzip: "gz", bz2: "bz2", lzma: "xz"}
    last = next(name for module, name in ending.items() if module.open is opener)
    jamlab.write(tmp_path / "p.dump", [p])
    jamlab.write(tmp_path / "p.data", p)
    for name in ("p.dump", "p.data"):
        whole = (tmp_path / name).read_bytes()
        with opener(tmp_path / f"{name}.{last}", "wb") as file:
            file.write(whole)
        assert np.array_equal(
            jamlab.read(tmp_path / f"{name}.{last}").positions, jamlab.read(tmp_path / name).positions
        )
        packed = (tmp_path / f"{name}.{last}").read_bytes()
        for damaged in (packed[: len(packed) // 2], b"plain text", packed[:40] + b"???" + packed[43:]):
            (tmp_path / f"{name}.{last}").write_bytes(damaged)
            with pytest.raises(StorageError):
                jamlab.read(tmp_path / f"{name}.{last}")


@pytest.mark.parametrize("kind", TEXTS)
def test_damaged_files_raise_errors_of_jamlab_only(tmp_path, kind):
    """In one line that names the file; or the damage is a number, which text does not show."""
    path = written(tmp_path, kind)
    whole, rng = path.read_bytes(), np.random.default_rng(0)
    for turn in range(90):
        at = int(rng.integers(len(whole)))
        put = rng.choice([b"nan", b"\n", b" 1e400 ", b"-", b"#", b"99999999999999999999", b",", b"\0"])
        damaged = (
            whole[:at],
            whole[:at] + bytes([int(rng.integers(256))]) + whole[at + 1 :],
            whole[:at] + put + whole[at:],
        )
        path.write_bytes(damaged[turn % 3])
        try:
            jamlab.read_all(path, **({"box": BOX} if kind == "csv" else {}))
        except jamlab.JamlabError as error:
            assert path.name in str(error) and "\n" not in str(error)


@pytest.mark.parametrize(
    ("name", "content", "error"),
    [
        (".", None, StorageError),
        ("*.h5", None, StorageError),
        ("a.csv", "1,2,0.5\n3,4,0.5\n", InputError),
        ("a.csv", "x,y,r,R\n1,2,1,1\n", InputError),
        ("a.csv", "x,y,r,z\n1,2,1,0\n2,1,1,3\n", InputError),
        ("a.csv", "x,y,r,d\n1,2,1,1\n", InputError),
        ("a.csv", "x,y\n1,2\n", InputError),
        ("a.csv", "x,y,r\n1,2\n", StorageError),
        ("a.csv", "x,y,r\n1,nan,1\n", StorageError),
        ("a.csv", "x,y,r\n", StorageError),
        ("a.csv", "", StorageError),
        ("a.npy", "x", StorageError),
        ("a.xyz", "1\nProperties=pos:R\n1 2\n", StorageError),
        ("a.xyz", "1\nLattice=1 Properties=pos:R:2\n1 2\n", StorageError),
        ("a.gsd.gz", "x", StorageError),
    ],
)
def test_tables_that_are_no_packing_are_refused(tmp_path, name, content, error):
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(error):
        jamlab.read(tmp_path / name, box=[5.0, 5.0])


def test_other_columns_and_sections_of_lammps_files_are_passed_over(tmp_path):
    p = jamlab.pack(n=8, pressure=1e-2, seed=1)
    jamlab.write(tmp_path / "p.dump", [p])
    *head, columns = (tmp_path / "p.dump").read_text().split("ITEM: ATOMS")
    names, *rows = columns.splitlines()
    wide = [f"{names} vx c_stress c_k", *(f"{row} 0 1 {row.split()[0]}" for row in rows)]
    (tmp_path / "p.dump").write_text("ITEM: UNITS\nlj\n" + head[0] + "ITEM: ATOMS" + "\n".join(wide) + "\n")
    assert jamlab.read(tmp_path / "p.dump") == p
    jamlab.write(tmp_path / "p.data", p)
    text = (tmp_path / "p.data").read_text() + "\nPair Coeffs\n\n1 2.0\n\nVelocities\n\n1 0 0 0\n"
    (tmp_path / "p.data").write_text(text)
    assert jamlab.read(tmp_path / "p.data").difference(p) is None
    (tmp_path / "p.data").write_text(text.replace(" 0 0 0 0\n", " 3 0 0 0\n", 1))
    with pytest.raises(InputError):  # an atom above the plane
        jamlab.read(tmp_path / "p.data")


def test_diameters_that_are_given_as_radii_are_asked_about(tmp_path):
    """In any source: disks then cover the box four times as often; a data file of jamlab says what it holds."""
    p = jamlab.pack(n=16, pressure=1e-2, seed=1)
    jamlab.write(tmp_path / "dense.data", jamlab.pack(n=8, phi=1.6, seed=1))
    for wrong in (False, True):
        rows = np.column_stack([p.positions, (1.0 if wrong else 0.5) * p.diameters])
        file = tmp_path / f"{wrong}.csv"
        file.write_text("x,y,radius\n" + "\n".join(",".join(map(repr, map(float, row))) for row in rows) + "\n")
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = jamlab.read(file, box=p.box, units="k")
            assert jamlab.read(tmp_path / "dense.data").phi == pytest.approx(1.6)
        assert [w.category for w in caught] == wrong * [jamlab.JamlabWarning]
        assert not wrong or f"{found.phi:.3g} times" in str(caught[0].message)
