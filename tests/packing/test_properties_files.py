"""Files of any packing come back as they were: HDF5 to the last bit, LAMMPS text to the last digit."""

import json

import numpy as np
import pytest
import random_packings
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from jamlab.packing.hdf5 import read, read_all, read_observables, write
from jamlab.packing.lammps_files import types, write_data, write_dump

in_one_folder = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
numbers = st.floats(allow_nan=False, allow_infinity=False)
characters = st.characters(exclude_categories=["Cs"])  # as by default, which takes seconds to look for those of UTF-8
values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | numbers | st.text(characters, max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(characters, max_size=5), inner, max_size=3),
    max_leaves=6,
)
histories = st.dictionaries(st.text(characters, max_size=8), values, max_size=4)


@st.composite
def sweeps(draw):
    """States of the same particles: moved, in other boxes, with what is written beside them."""
    first = draw(random_packings.packings())
    frames = []
    for _ in range(draw(st.integers(1, 3))):
        shift = draw(st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
        onset = draw(st.none() | st.floats(0.1, 1.0))
        box = first.box * draw(st.floats(0.9, 1.1))
        place = {"box": box, "positions": first.positions + shift}
        frames.append(first.with_state(**place, onset=onset, provenance=draw(histories)))
    return frames


def assert_same(got, wanted):
    for name in ("box", "positions", "diameters", "offsets"):
        a, b = getattr(got, name), getattr(wanted, name)
        assert (a is None) == (b is None) and (a is None or (a.dtype == b.dtype and a.tobytes() == b.tobytes())), name
    for name in ("model", "units", "onset", "provenance"):
        assert getattr(got, name) == getattr(wanted, name), name
    assert got.params.keys() == wanted.params.keys()
    assert all(np.array_equal(got.params[name], value) for name, value in wanted.params.items())


@in_one_folder
@given(frames=sweeps(), data=st.data())
def test_hdf5(tmp_path, frames, data):
    g = data.draw(st.lists(numbers, min_size=len(frames), max_size=len(frames)))
    write(tmp_path / "run.h5", frames, {"g": g})
    for got, wanted in zip(read_all(tmp_path / "run.h5"), frames, strict=True):
        assert_same(got, wanted)
    frame = data.draw(st.integers(-len(frames), len(frames) - 1))
    assert_same(read(tmp_path / "run.h5", frame), frames[frame])
    assert read_observables(tmp_path / "run.h5")["g"].tolist() == g
    # what is read is written alike
    write(tmp_path / "again.h5", read_all(tmp_path / "run.h5"), {"g": g})
    for got, wanted in zip(read_all(tmp_path / "again.h5"), frames, strict=True):
        assert_same(got, wanted)
        assert json.dumps(got.provenance) == json.dumps(wanted.provenance)


def sections(text):
    """Heading -> rows of numbers, of a LAMMPS data file."""
    found, rows = {}, None
    for line in text.splitlines()[1:]:
        words = line.split("#")[0].split()
        if (words and words[0].isalpha()) or line.startswith("d_a0"):
            rows = found.setdefault(words[0], [])
        elif words and rows is not None:
            rows.append([float(word) for word in words])
    return {name: np.array(rows) for name, rows in found.items()}


@in_one_folder
@given(packing=random_packings.packings())
def test_lammps_data(tmp_path, packing):
    """Image flags unwrap to the packing; the box is that of the header; bonds run round every polygon."""
    table = write_data(tmp_path / "p.data", packing)
    text = (tmp_path / "p.data").read_text()
    head = {line.split()[-1]: line.split() for line in text.splitlines() if line.endswith(("xhi", "yhi", "yz"))}
    box = [[float(head["xhi"][1]), 0.0], [float(head["yz"][0]), float(head["yhi"][1])]]
    assert np.array_equal(box, packing.box)
    found = sections(text)
    atoms = found["Atoms"]
    wrapped, image = atoms[:, -6:-4], atoms[:, -3:-1]
    scale = 1 + np.abs(packing.positions).max()
    np.testing.assert_allclose(wrapped + image @ packing.box, packing.positions, rtol=0, atol=4e-16 * scale)
    inside = wrapped @ np.linalg.inv(packing.box)
    assert inside.min() > -1e-12 and inside.max() < 1 + 1e-12
    kind = atoms[:, -7].astype(int)
    sizes = packing.diameters if packing.model == "sp" else packing.params["a0"]
    assert np.array_equal(table.values[kind - 1], sizes[packing.particle])
    if packing.model == "dp":
        assert np.array_equal(atoms[:, 1], packing.particle + 1)
        assert np.array_equal(found["Bonds"][:, 2:] - 1, np.column_stack([np.arange(len(kind)), packing.successor]))
        assert np.array_equal(found["d_a0"][:, 1], sizes[packing.particle])


@in_one_folder
@given(frames=sweeps())
def test_lammps_dump(tmp_path, frames):
    """Positions as they are; bounds of the box as LAMMPS defines them."""
    write_dump(tmp_path / "run.dump", frames)
    parts = (tmp_path / "run.dump").read_text().split("ITEM: TIMESTEP\n")[1:]
    for step, (part, packing) in enumerate(zip(parts, frames, strict=True)):
        lines = part.splitlines()
        assert int(lines[0]) == step and int(lines[2]) == len(packing.positions)
        (low, high, xy), (bottom, top, _) = (map(float, line.split()) for line in lines[4:6])
        low, high = low - min(0.0, xy), high - max(0.0, xy)
        assert [[high - low, 0], [xy, top - bottom]] == pytest.approx(packing.box, rel=1e-14, abs=1e-14)
        rows = np.array([line.split() for line in lines[8:]], dtype=float)
        assert rows[:, 3:5].tobytes() == packing.positions.tobytes()
        assert np.array_equal(rows[:, 2], types(packing).types[packing.particle])
        if packing.model == "sp":
            assert np.array_equal(2 * rows[:, 6], packing.diameters)
