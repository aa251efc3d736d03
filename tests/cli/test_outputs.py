"""Files that commands write: none is replaced unasked, and an interrupt loses no state that is finished."""

import pytest
from commands import call

import jamlab
from jamlab.cli.interruption import Interrupted
from jamlab.cli.kept_states import KeptStates


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
