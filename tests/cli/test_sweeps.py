"""Sweeps that are interrupted: the same command goes on, to the same bits, and nothing else is taken for it."""

import h5py
import numpy as np
import pytest
from commands import call

import jamlab
from jamlab.cli import sweep_file
from jamlab.protocols import compression

LINE = "compress onset.h5 --to {to} --step 0.01 --out sweep.h5"


def stop_after(monkeypatch, states):
    """Let a sweep end as by Ctrl-C after some states, which the first file has."""
    whole = compression.go_on

    def part(*args, **named):
        for count, state in enumerate(whole(*args, **named), start=1):
            yield state
            if count == states:
                raise KeyboardInterrupt

    monkeypatch.setattr("jamlab.protocols.compression.go_on", part)


@pytest.mark.parametrize(
    ("model", "n", "to", "more"),
    [
        ("sp", 16, 0.9, ""),
        ("dp", 6, 0.9, ""),
        pytest.param("sp", 16, 0.9, "--by phi --first-step 1e-3", marks=pytest.mark.slow),
    ],
)
def test_a_sweep_goes_on_to_the_same_bits(tmp_path, monkeypatch, model, n, to, more):
    jamlab.write(tmp_path / "onset.h5", jamlab.jam(n, model, 1))
    line = [*LINE.format(to=to).split(), *more.split()]
    assert call(tmp_path, *line).exit_code == 0
    (tmp_path / "sweep.h5").rename(tmp_path / "whole.h5")
    with monkeypatch.context() as patch:
        stop_after(patch, 1)
        for kept in (2, 3):
            call(tmp_path, *line)
            assert len(jamlab.read_all(tmp_path / "sweep.h5")) == kept
    assert call(tmp_path, *line).exit_code == 0
    with h5py.File(tmp_path / "whole.h5") as whole, h5py.File(tmp_path / "sweep.h5") as parts:
        for name in ("particles/all/position/value", "particles/all/box/edges/value"):
            assert np.array_equal(whole[name], parts[name])
        for name in whole["observables"]:
            assert np.array_equal(
                whole[f"observables/{name}/value"], parts[f"observables/{name}/value"], equal_nan=True
            )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder with a sweep of which two states are made."""
    folder = tmp_path_factory.mktemp("half")
    jamlab.write(folder / "onset.h5", jamlab.jam(16, seed=1))
    jamlab.write(folder / "other.h5", jamlab.jam(16, seed=2))
    with pytest.MonkeyPatch.context() as patch:
        stop_after(patch, 2)
        call(folder, *LINE.format(to=0.9).split())
    return folder


@pytest.fixture
def half(made, tmp_path):
    """A copy of it."""
    for file in made.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


@pytest.mark.parametrize(
    ("line", "named"),
    [
        (LINE.format(to=0.95), "--to 0.9, not 0.95"),
        (LINE.format(to=0.9).replace("0.01", "0.02"), "--step 0.01, not 0.02"),
        (LINE.format(to=0.9) + " --force-tolerance 1e-11", "--force-tolerance left out, not 1e-11"),
        (LINE.format(to=0.9).replace("onset", "other"), "from another packing"),
    ],
)
def test_a_sweep_of_other_options_is_refused_by_what_differs(half, line, named):
    """And nobody is led to replace the states that are there."""
    before = (half / "sweep.h5").read_bytes()
    done = call(half, *line.split())
    assert done.exit_code == 1 and named in done.stderr and "--overwrite" not in done.stderr
    assert (half / "sweep.h5").read_bytes() == before


def test_a_damaged_sweep_is_not_gone_on_with(half):
    content = bytearray((half / "sweep.h5").read_bytes())
    content[len(content) // 2] ^= 1
    (half / "sweep.h5").write_bytes(content)
    done = call(half, *LINE.format(to=0.9).split())
    assert done.exit_code == 1 and "sweep.h5 exists" in done.stderr
    assert (half / "sweep.h5").read_bytes() == content


def test_the_line_says_how_many_states_are_kept_and_where_they_end(half, monkeypatch):
    file = sweep_file.SweepFile(half / "sweep.h5", {}, replace=True)
    assert file._describe() == f"nothing was written; {half}/sweep.h5 is as it was before"
    file.states = jamlab.read_all(half / "sweep.h5")
    last = file.states[-1].provenance["target"]
    assert file._describe() == (f"kept 3 states up to rho = {last:.5g} in {half}/sweep.h5; the same command resumes it")


def test_a_state_that_is_no_minimum_ends_the_sweep_for_good(half):
    *states, last = jamlab.read_all(half / "sweep.h5")
    with pytest.raises(jamlab.ConvergenceError, match="is no minimum, the sweep ends there"):
        compression.go_on(last.with_state(converged=False), states[0], len(states), 0.9, 0.01)


@pytest.mark.slow
def test_demo_goes_on_with_the_model_it_was_making(tmp_path, monkeypatch):
    line = ["demo", "--n", "8", "--to", "0.88"]
    with monkeypatch.context() as patch:
        stop_after(patch, 3)
        call(tmp_path, *line)
    folder = tmp_path / "jamlab-demo"
    assert {p.name for p in folder.iterdir()} == {"sp.h5"}
    begun = jamlab.read_all(folder / "sp.h5")
    assert call(tmp_path, *line).exit_code == 0
    assert jamlab.read_all(folder / "sp.h5")[: len(begun)] == begun
    assert {p.name for p in folder.iterdir()} == {"sp.h5", "dp.h5", "index.html"}
