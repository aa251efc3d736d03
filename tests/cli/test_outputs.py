"""Files that commands write: none is replaced unasked, an interrupt loses no finished state and says what is kept."""

import ctypes
import inspect
import json
import pathlib
import shlex

import campaigns
import pytest
import typer
from campaigns import names
from commands import call

import jamlab
from jamlab.campaign.campaign import CampaignRun
from jamlab.cli import interruption
from jamlab.cli.main import app


@pytest.fixture(scope="module")
def onset():
    return jamlab.jam(n=16, seed=1)


FLOWS = {
    "shear": "--rate 0.1 --strain 0.01",
    "flow-curve": "--rate 0.1 --strain 1",
    "oscillate": "--omega 0.1 --amplitude 1e-3",
    "creep": "--stress 1e-4 --duration 1",
    "relax-stress": "--strain 1e-3 --duration 1",
    "quasistatic-shear": "--strain 2e-3",
    "stop-flow": "--duration 1",
}
WRITTEN = {  # command and its option that names what is written: its other words, files that it may not replace unasked
    ("demo", "--folder"): ("--n 8", ["index.html", "sp.h5", "dp.h5"]),
    ("jam", "--out"): ("--n 8", "p.h5"),
    ("pack", "--out"): ("--n 8 --pressure 1e-2", "p.h5"),
    ("compress", "--out"): ("source.h5 --to 0.86", "p.h5"),
    ("relax", "--out"): ("source.h5", "p.h5"),
    ("decompress", "--out"): ("source.h5 --pressure 1e-6", "p.h5"),
    **{(name, "--out"): ("source.h5", "p.h5") for name in ("anneal", "swap-sizes", "relax-radii")},
    ("droplets", "--out"): ("d.csv --box 9,9", "p.h5"),
    ("explore", "--out"): ("source.h5", "p.html"),
    ("analyze", "--csv"): ("photo.png", "p.csv"),
    ("analyze", "--overlay"): ("photo.png", "p.png"),
    ("analyze", "--out"): ("photo.png", "p.h5"),
    ("gstar", "--out"): ("source.h5", "g.csv"),
    **{(name, "--out"): (f"source.h5 {words}", "p.h5") for name, words in FLOWS.items()},
    **{(name, "--csv"): (f"source.h5 {words}", "p.csv") for name, words in FLOWS.items()},
    **{(name, "--plot"): (f"source.h5 {words}", "p.png") for name, words in FLOWS.items()},
    ("decks", "--copy"): ("", ["in.sp.shear"]),
    ("campaign new", "campaign"): ("", "new.toml"),
}
READ = {"file", "files", "folders", "source", "campaign", "--from", "--labels"}
TASKS = {f"campaign {name}" for name in ("plan", "run", "resume", "status", "export", "aggregate")}


def test_every_option_that_names_a_file_to_write_is_tried():
    """But for folders of tasks, which grow, and `campaign export --out`, see tests/campaign/test_command.py."""

    def commands(group, *path):
        for name, each in group.commands.items():
            yield from commands(each, *path, name) if hasattr(each, "commands") else [(" ".join([*path, name]), each)]

    found = {
        (name, option.opts[0])
        for name, command in commands(typer.main.get_command(app))
        for option in command.params
        if "Path" in str(inspect.signature(command.callback).parameters[option.name].annotation) and name not in TASKS
    }
    assert {
        (name, option) for name, option in found if option not in {*READ, "target"} or name == "campaign new"
    } <= set(WRITTEN)


@pytest.mark.parametrize(("command", "option"), WRITTEN, ids=[" ".join(each) for each in WRITTEN])
def test_no_file_is_replaced_without_force_or_gets_a_name_of_another_format(tmp_path, onset, command, option):
    words, names = WRITTEN[command, option]
    jamlab.write(tmp_path / "source.h5", onset)
    (tmp_path / "photo.png").write_bytes(b"never read")
    (tmp_path / "c.toml").write_text(campaigns.FULL)
    line = [*command.split(), *words.split(), *([] if option == "campaign" else [option])]
    for name in [names] if isinstance(names, str) else names:
        out = tmp_path / name if isinstance(names, str) else tmp_path / f"folder-{name}" / name
        out.parent.mkdir(exist_ok=True)
        out.write_text("work of a week")
        target = out if isinstance(names, str) else out.parent
        done = call(tmp_path, *line, target)
        assert done.exit_code == 1 and out.name in done.stderr, done.stderr
        assert (out.read_text() == "work of a week" and list(out.parent.glob("*")) == [out]) or target == out
    before = set(tmp_path.iterdir())
    for name in ("out.xlsx", "out.data") if isinstance(names, str) else ():
        done = call(tmp_path, *line, name)
        assert done.exit_code == 1 and name in done.stderr, done.stderr
        assert set(tmp_path.iterdir()) == before


def test_force_replaces_files(tmp_path, onset):
    jamlab.write(tmp_path / "source.h5", next(jamlab.compress(onset, 0.87, 0.1)))
    for words in ("jam --n 8 --out p.h5", "explore source.h5 --out p.html", "gstar source.h5 --points 3 --out g.csv"):
        out = tmp_path / words.split()[-1]
        out.write_text("work of a week")
        assert call(tmp_path, *words.split(), "--overwrite").exit_code == 0
        assert out.read_bytes()[:4] != b"work"


def test_a_forced_table_leaves_the_run_it_is_made_of(tmp_path, onset, monkeypatch):
    """A run of hours goes on where it is, whatever else is replaced."""
    jamlab.write(tmp_path / "source.h5", onset)
    words = [*"shear source.h5 --rate 0.1 --strain 0.01 --rows 2 --csv rows.csv --out flow.h5".split()]
    assert call(tmp_path, *words).exit_code == 0
    monkeypatch.delattr(pathlib.Path, "unlink")
    assert call(tmp_path, *words, "--overwrite").exit_code == 0


WRONG = {
    "shear": "--tolerance 7",
    "creep": "--tolerance 7",
    "oscillate": "--cycles 0",
    "relax-stress": "--damping tau=-1",
    "stop-flow": "--tolerance 7",
}
WRONG["quasistatic-shear"] = "--strain-step 9"


@pytest.mark.parametrize("name", FLOWS)
def test_a_forced_flow_replaces_a_file_by_what_it_saves_first(tmp_path, onset, monkeypatch, name):
    """Until then the old file stays, whatever ends the command: a value that is refused, a signal, an error."""
    jamlab.write(tmp_path / "source.h5", next(jamlab.compress(onset, 0.87, 0.1)))
    (tmp_path / "f.h5").write_text("work of a week")
    line = [name, "source.h5", *FLOWS[name].split(), "--out", "f.h5", "--overwrite"]
    said = call(tmp_path, *line, *WRONG.get(name, "--discard -1").split())
    assert said.exit_code == 1 and (tmp_path / "f.h5").read_text() == "work of a week"

    def stop(*_, **__):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("jamlab.flow.run.RunFile.save", stop)
        patch.setattr("jamlab.flow.run.write_result", stop)
        assert call(tmp_path, *line).exit_code == 1
    assert (tmp_path / "f.h5").read_text() == "work of a week"
    assert {each.name for each in tmp_path.iterdir()} == {"f.h5", "source.h5"}


def test_a_forced_flow_replaces_a_file_in_the_end(tmp_path, onset):
    jamlab.write(tmp_path / "source.h5", next(jamlab.compress(onset, 0.87, 0.1)))
    (tmp_path / "f.h5").write_text("work of a week")
    line = ["creep", "source.h5", *FLOWS["creep"].split(), "--out", "f.h5"]
    assert "belongs to another run" in call(tmp_path, *line).stderr
    assert call(tmp_path, *line, "--overwrite").exit_code == 0
    assert jamlab.read_flow(tmp_path / "f.h5").time[-1] == pytest.approx(1)


@pytest.fixture
def said(monkeypatch):
    """What would be printed if a signal came now."""
    monkeypatch.setattr(interruption, "_describe", lambda: "not told")
    return interruption.last_line


@pytest.mark.parametrize("error", [KeyboardInterrupt(), ctypes.ArgumentError("argument 7: KeyboardInterrupt")])
def test_a_signal_while_states_are_measured_keeps_them(tmp_path, onset, monkeypatch, error):
    """Also one that ctypes makes another error of: raised while it converts arguments."""

    def stop(*_, **__):
        interruption._came.append(2)
        raise error

    monkeypatch.setattr(interruption, "_came", [])
    jamlab.write(tmp_path / "onset.h5", onset)
    monkeypatch.setattr("jamlab.cli.jam.print_packings", stop)
    done = call(tmp_path, "compress", "onset.h5", "--to", "0.86", "--out", "sweep.h5")
    assert done.exit_code == 130 and done.stderr.startswith("interrupted: kept ") and done.stderr.count("\n") == 1
    assert len(jamlab.read_all(tmp_path / "sweep.h5")) > 2


@pytest.mark.parametrize("error", [KeyboardInterrupt(), jamlab.ConvergenceError("unjammed")], ids=["signal", "error"])
@pytest.mark.parametrize("made", [0, 1, 2])
@pytest.mark.parametrize("interval", [-1.0, 10.0])
def test_finished_states_are_kept_where_a_sweep_ends(tmp_path, onset, monkeypatch, error, made, interval):
    """The start alone, which nobody has waited for, is not written; states are written on the way, too."""
    out, written = tmp_path / "sweep.h5", []

    def sweep(*_, **__):
        for _ in range(made):
            yield onset
            written.append(out.exists())
        raise error

    jamlab.write(tmp_path / "onset.h5", onset)
    monkeypatch.setattr("jamlab.cli.sweep_file.INTERVAL", interval)
    monkeypatch.setattr("jamlab.protocols.compression.go_on", sweep)
    assert call(tmp_path, "compress", "onset.h5", "--to", "0.9", "--out", "sweep.h5").exit_code == 1
    assert written == [interval < 0] * len(written)
    assert out.exists() == bool(made) and (not made or len(jamlab.read_all(out)) == 1 + made)


DISKS = 'name = "c"\n[[sweep]]\nname = "disks"\nmodel = "sp"\nn = 16\nseeds = 12\nonset = true\n'


@pytest.mark.parametrize("out", [None, "elsewhere"])
def test_the_line_counts_tasks_and_its_command_finds_them(tmp_path, monkeypatch, said, out):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text(DISKS)
    campaign = jamlab.open_campaign("c.toml", out)
    campaign.folder.prepare()
    for name in ("0" * 32, *names("c.toml")[:3]):  # one of another campaign
        campaign.folder.task_file(name).touch()
    lines, nothing = [], CampaignRun(0, 0, {}, 0)
    monkeypatch.setattr("jamlab.campaign.campaign.Campaign.run", lambda *_, **__: lines.append(said()) or nothing)
    call(tmp_path, "campaign", "run", "c.toml", *(["--folder", out] if out else []))
    assert f"3 of 12 tasks are finished in {out or 'c'}; " in lines[0]
    words = shlex.split(lines[0].split("`")[1])
    assert words[:3] == ["jamlab", "campaign", "resume"]
    assert json.loads(call(tmp_path, "campaign", "status", *words[3:], "--json").stdout)["finished"] == 3
