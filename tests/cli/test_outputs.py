"""Files that commands write: none is replaced unasked, and an interrupt loses no state that is finished."""

import ctypes

import pytest
from commands import call

import jamlab
from jamlab.cli import interruption
from jamlab.cli.flow import FlowOptions, expect_files
from jamlab.cli.interruption import Interrupted, KeptStates
from jamlab.cli.main import app


@pytest.fixture(scope="module")
def onset():
    return jamlab.jam(n=16, seed=1)


@pytest.mark.parametrize(
    "words",
    [
        ["jam", "--n", "8"],
        ["pack", "--n", "8", "--pressure", "1e-2"],
        ["compress", "onset.h5", "--to", "0.86"],
        ["explore", "onset.h5"],
        ["demo", "--n", "8"],
    ],
    ids=lambda words: words[0],
)
def test_no_file_is_replaced_without_force(tmp_path, onset, words):
    onset.write(tmp_path / "onset.h5")
    out = "out" if words[0] == "demo" else "out.html" if words[0] == "explore" else "out.h5"
    there = tmp_path / out / "dp.h5" if words[0] == "demo" else tmp_path / out
    there.parent.mkdir(exist_ok=True)
    there.write_text("work of a week")
    done = call(tmp_path, *words, "--out", out)
    assert done.exit_code == 1 and f"{there.name} exists: choose another name, or give --force" in done.stderr
    assert there.read_text() == "work of a week"
    if words[0] in ("jam", "explore"):
        assert call(tmp_path, *words, "--out", out, "--force").exit_code == 0
        assert there.read_bytes()[:14] != b"work of a week"


@pytest.mark.parametrize("suffix", [".csv", ".h5"])
def test_no_spectrum_is_replaced_without_force(tmp_path, onset, suffix):
    next(jamlab.compress(onset, 0.87, 0.1)).write(tmp_path / "p.h5")
    there = tmp_path / f"g{suffix}"
    there.write_text("work of a week")
    words = ("gstar", "p.h5", "--points", "3", "--out", there.name)
    done = call(tmp_path, *words)
    assert done.exit_code == 1 and f"{there.name} exists: choose another name, or give --force" in done.stderr
    assert there.read_text() == "work of a week"
    assert call(tmp_path, *words, "--force").exit_code == 0 and there.read_bytes()[:4] != b"work"


@pytest.mark.parametrize("option", ["--csv", "--overlay", "--packing"])
def test_nothing_that_was_made_of_a_picture_is_replaced_without_force(tmp_path, option):
    (tmp_path / "photo.png").write_bytes(b"never read")
    there = tmp_path / {"--csv": "d.csv", "--overlay": "o.png", "--packing": "p.h5"}[option]
    there.write_text("work of a week")
    done = call(tmp_path, "analyze", "photo.png", option, there.name)
    assert done.exit_code == 1 and f"{there.name} exists: choose another name, or give --force" in done.stderr
    assert there.read_text() == "work of a week"
    done = call(tmp_path, "analyze", "photo.png", option, there.name, "--force")  # the picture is read now
    assert done.exit_code == 1 and "exists" not in done.stderr


def test_finished_states_are_kept_where_a_signal_ends_a_sweep(tmp_path, onset):
    kept = KeptStates(tmp_path / "sweep.h5")
    with pytest.raises(Interrupted), kept:
        kept.add(onset)
        assert kept._describe() == "nothing was written"
        for state in jamlab.compress(onset, to=0.87, step=0.01):
            kept.add(state)
        raise Interrupted(2)
    assert f"kept {len(kept.states)} states" in kept._describe()
    assert [p.phi for p in jamlab.read_all(tmp_path / "sweep.h5")] == [p.phi for p in kept.states]


def test_what_ctypes_makes_of_a_signal_is_the_signal(tmp_path, onset, monkeypatch):
    """An exception raised while arguments are converted comes out as ctypes.ArgumentError."""
    monkeypatch.setattr(interruption, "_came", [2])
    kept = KeptStates(tmp_path / "sweep.h5")
    with pytest.raises(ctypes.ArgumentError), kept:
        for _ in range(2):
            kept.add(onset)
        raise ctypes.ArgumentError("argument 7: Interrupted: 2")
    assert len(jamlab.read_all(tmp_path / "sweep.h5")) == 2

    def stop(*_, **__):
        raise ctypes.ArgumentError("argument 7: Interrupted: 2")

    onset.write(tmp_path / "onset.h5")
    monkeypatch.setattr("jamlab.trajectories.files.read_all", stop)
    with pytest.raises(Interrupted):
        app(["analyze", str(tmp_path / "onset.h5")], standalone_mode=False)


def test_a_signal_while_states_are_measured_keeps_them(tmp_path, onset, monkeypatch):
    def stop(*_):
        raise Interrupted(2)

    onset.write(tmp_path / "onset.h5")
    monkeypatch.setattr("jamlab.cli.jam.print_packings", stop)
    with pytest.raises(Interrupted):
        words = ["compress", str(tmp_path / "onset.h5"), "--to", "0.86", "--out", str(tmp_path / "sweep.h5")]
        app(words, standalone_mode=False)
    assert len(jamlab.read_all(tmp_path / "sweep.h5")) > 2


def test_the_line_of_a_flow_names_the_file_as_long_as_it_is_there(tmp_path, onset, monkeypatch):
    monkeypatch.setattr(interruption, "_describe", lambda: "not told")
    out = tmp_path / "run.h5"
    expect_files(FlowOptions(tmp_path / "onset.h5", out=out))
    assert interruption._describe() == "nothing was written"
    out.write_text("of yesterday")
    assert "as it was last saved; the same command goes on" in interruption._describe()


def test_the_start_alone_is_not_written_and_errors_write_nothing(tmp_path, onset):
    for error in (Interrupted(2), jamlab.ConvergenceError("came loose")):
        kept = KeptStates(tmp_path / "sweep.h5")
        with pytest.raises(type(error)), kept:
            kept.add(onset)
            raise error
    assert not list(tmp_path.iterdir())


def test_states_are_written_on_the_way(tmp_path, onset):
    """So that even a process that is killed leaves those of the last seconds but a few."""
    kept = KeptStates(tmp_path / "sweep.h5", interval=0.0)
    with kept:
        for k in range(3):
            kept.add(onset)
            assert (tmp_path / "sweep.h5").exists() == (k > 0)
    assert len(jamlab.read_all(tmp_path / "sweep.h5")) == 3


def test_states_are_there_while_they_are_measured(tmp_path, onset):
    with KeptStates(tmp_path / "sweep.h5") as kept:
        for _ in range(3):
            kept.add(onset)
        assert not (tmp_path / "sweep.h5").exists()
    assert len(jamlab.read_all(tmp_path / "sweep.h5")) == 3
