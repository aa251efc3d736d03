"""`jamlab deck`: what it reads is not written over, what it needs and cannot write is said before LAMMPS starts."""

import os

import pytest
from commands import call

import jamlab
from jamlab.cli import decks
from jamlab.engine.deck_defaults import settings
from jamlab.engine.deck_files import summaries
from jamlab.installed_files import installed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("deck")
    jamlab.write(folder / "p.data", jamlab.jam(8, seed=1))
    return folder


def test_files_that_decks_write_are_known():
    """Each deck says at its head what it writes."""
    for name in summaries(installed("lammps_inputs")):
        path = installed("lammps_inputs") / name
        known = settings(path.parent, name)
        head = path.read_text().partition("\n\n")[0].replace("\n# ", " ")
        for file in decks.written(path, known) - {decks.Path(f"{known['out']}.failed.data")}:
            assert file.name in head, (name, file)


@pytest.mark.parametrize("name", ["x.sheared.data", "soft.data", "hard.data", "./x.sheared.data"])
def test_a_deck_does_not_write_what_it_reads(folder, name):
    source = folder / "x.sheared.data"
    source.write_bytes((folder / "p.data").read_bytes())
    for link in (folder / "soft.data", folder / "hard.data"):
        link.unlink(missing_ok=True)
    (folder / "soft.data").symlink_to(source)
    os.link(source, folder / "hard.data")
    done = call(folder, "deck", "in.sp.shear", "--data", name, "--out", "x")
    assert done.exit_code == 1 and "it is also the input" in done.stderr
    assert source.read_bytes() == (folder / "p.data").read_bytes()


def test_what_is_missing_is_said(folder, monkeypatch):
    said = call(folder, "deck", "in.sp.shear").stderr
    assert "no sp.onset.data" in said and "--data FILE" in said and "jamlab deck in.sp.jam" in said
    said = call(folder, "deck", "in.dp.shear").stderr
    assert "no dp.onset.data" in said and "jamlab deck in.dp.jam" in said
    assert "no folder" in call(folder, "deck", "in.sp.jam", "--out", "nowhere/x").stderr
    monkeypatch.setattr("jamlab.storage.atomic_file.os.access", lambda *_: False)
    assert "log.lammps: the folder" in call(folder, "deck", "in.sp.jam").stderr


@pytest.mark.parametrize(
    ("line", "use"),
    [
        ("in.sp.compress --force 1e-9", "use --force-tolerance"),
        ("in.sp.compress --nearest 1e-4", "use --first-step"),
        ("in.sp.compress --above 0.1", "use --step"),
        ("in.sp.compress --ratio 1.2", "use --size-ratio"),
        ("in.sp.shear --phi-target 0.9", "use --to"),
        ("in.sp.jam --N 8", "use --n"),
        ("in.sp.startup --accuracy 1e-3", "use --tolerance"),
        ("in.sp.startup --background 1", "use --background-drag"),
        ("in.sp.startup --arms radius", "use --lever-arms"),
        ("in.dp.startup --viscous stokes", "use --damping"),
    ],
)
def test_words_from_habit_lead_to_variables(folder, line, use):
    done = call(folder, "deck", *line.split())
    assert done.exit_code == 1 and use in done.stderr


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("in.sp.compress --data p.data --search-step 0.1", "search-step"),
        ("in.sp.startup --data p.data --short-edge 0.1", "short-edge"),
        ("in.dp.startup --even 0.1", "even"),
        ("in.dp.startup --damping stokes --beta 0.1", "beta"),
    ],
)
def test_what_a_deck_would_ignore_is_refused(folder, line, name):
    done = call(folder, "deck", *line.split())
    assert done.exit_code == 1 and name in done.stderr


def test_lammps_that_a_signal_ended_is_said(folder, monkeypatch):
    monkeypatch.setattr(decks, "_run", lambda _: -9)
    assert "signal 9 ended LAMMPS" in call(folder, "deck", "in.sp.jam").stderr
