"""Files of any packing come back as they were: HDF5 to the last bit, LAMMPS text to the last digit."""

import json

import numpy as np
import random_packings
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from jamlab.packing.hdf5 import read_all_hdf5, read_hdf5, read_observables
from jamlab.packing.write import write

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
        frames.append(first.with_state(**place, phi_J=onset, provenance=draw(histories)))
    return frames


def assert_same(got, wanted):
    for name in ("box", "positions", "diameters", "offsets"):
        a, b = getattr(got, name), getattr(wanted, name)
        assert (a is None) == (b is None) and (a is None or (a.dtype == b.dtype and a.tobytes() == b.tobytes())), name
    for name in ("model", "units", "phi_J", "provenance"):
        assert getattr(got, name) == getattr(wanted, name), name
    assert got.params.keys() == wanted.params.keys()
    assert all(np.array_equal(got.params[name], value) for name, value in wanted.params.items())


@in_one_folder
@given(frames=sweeps(), data=st.data())
def test_hdf5(tmp_path, frames, data):
    g = data.draw(st.lists(numbers, min_size=len(frames), max_size=len(frames)))
    write(tmp_path / "run.h5", frames, {"g": g})
    for got, wanted in zip(read_all_hdf5(tmp_path / "run.h5"), frames, strict=True):
        assert_same(got, wanted)
    frame = data.draw(st.integers(-len(frames), len(frames) - 1))
    assert_same(read_hdf5(tmp_path / "run.h5", frame), frames[frame])
    assert read_observables(tmp_path / "run.h5")["g"].tolist() == g
    # what is read is written alike
    write(tmp_path / "again.h5", read_all_hdf5(tmp_path / "run.h5"), {"g": g})
    for got, wanted in zip(read_all_hdf5(tmp_path / "again.h5"), frames, strict=True):
        assert_same(got, wanted)
        assert json.dumps(got.provenance) == json.dumps(wanted.provenance)
