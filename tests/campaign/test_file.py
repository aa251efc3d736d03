"""Campaign files: what is valid survives being written and read, what is not is named; names of tasks."""

import os
import subprocess
import sys

import campaigns
import pytest
from campaigns import SWEEP, names, read_campaign_file, written
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import jamlab
from jamlab.campaign.driver import remaining_tasks
from jamlab.campaign.file import CampaignTable
from jamlab.campaign.tasks import Parameters, batches, task_name
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"model": "spx"}, r"sweep\[1\] \(disks\)\.model\[1\] = 'spx': use one of 'sp' or 'dp'"),
        ({"n": 15}, r"n = 15: .* even"),
        ({"n": 0}, r"n\[1\] = 0: must be 2 or more"),
        ({"n": "x"}, r"n\[1\] = 'x': must be a whole number"),
        ({"n": []}, r"n = \[\]: the list is empty"),
        ({"seeds": 0}, r"seeds = 0: give a number of seeds"),
        ({"seeds": True}, r"seeds = True: give a number of seeds"),
        ({"seeds": {"first": 5, "last": 4}}, r"seeds: first = 5 is above last = 4: swap them"),
        ({"seeds": {"first": 5}}, r"seeds\.last is missing: add it"),
        ({"seeds": {"first": 5, "last": 9, "step": 2}}, r"seeds\.step = 2: unknown key, use first, last$"),
        ({"seeds": {"first": 5, "last": 6.0}}, r"seeds\.last = 6\.0: must be a whole number"),
        ({"seeds": {"first": 5, "last": 10**12}}, r"5 to 1000000000000 are too many, at most 1000000"),
        ({"seeds": [1, 2, 1]}, r"seeds = \[1, 2, 1\]: 1 is listed twice"),
        ({"seeds": [-1]}, r"seeds\[1\] = -1: must be 0 or more"),
        ({"seed": 3}, r"seed = 3: unknown key, did you mean seeds\?"),
        ({"name": "a b"}, r"name = 'a b': use letters"),
        ({"ensemble": "npt"}, r"ensemble = 'npt': use one of 'fixed-box' or 'shear-stabilized'"),
        ({"compress": None}, r"none of them: give exactly one of compress, pressures, phi and onset"),
        ({"compress": None, "phi": [2.5]}, r"phi\[1\] = 2.5: must be"),
        ({"compress": None, "phi": [0.8], "model": "dp"}, r"phi are for model sp"),
        ({"compress": None, "phi": [0.8], "ensemble": "shear-stabilized"}, r"phi is for ensemble fixed-box"),
        ({"pressures": [0.01]}, r"compress and pressures: give exactly one"),
        ({"compress": {"to": 1.2}}, r"to = 1.2 is above 1, .*: lower it, or set by = 'phi'"),
        ({"compress": {"to": 0.9, "nearest": 0.1}}, r"nearest = 0.1 is above step = 0.01: lower it"),
        ({"compress": {"to": 0.9, "steps": 0.1}}, r"compress\.steps = 0.1: unknown key, did you mean step\?"),
        ({"compress": {"step": 0.1}}, r"compress\.to is missing: add it"),
        ({"compress": 0.9}, r"compress = 0.9: must be a table"),
        ({"compress": None, "pressures": [0.5]}, r"pressures\[1\] = 0.5: must be 0.3 or less"),
        ({"compress": None, "pressures": [0.01], "model": ["sp", "dp"]}, r"pressures are for model sp"),
        ({"compress": None, "pressures": [0.01], "decompress": True}, r"decompress .*: give two pressures or more"),
        ({"decompress": True}, r"decompress .*: leave it out"),
        ({"model": "dp", "prestress": False}, r"prestress = false is for model sp"),
        ({"model": "dp", "observables": ["quasistatic"]}, r"'quasistatic' is for model sp"),
        ({"observables": ["modes"]}, r"'modes' is for model dp"),
        ({"model": "dp", "observables": ["modes"], "damping": {}}, r"'modes' needs a damping law"),
        ({"model": "dp", "n": 128, "observables": ["modes"]}, r"'modes' of 1856 vertices: at most 1024"),
        ({"model": "dp", "force_law": {"gama": 1.0}}, r"force_law: model dp has no parameter 'gama': use .*gamma"),
        ({"model": "dp", "force_law": {"ka": -1.0}}, r"force_law: .*'ka'\] is -1.0"),
        ({"ranks": 0}, r"ranks = 0: must be 1 or more"),
        ({"ranks": 2.5}, r"ranks = 2.5: must be a whole number"),
        ({"model": "dp", "ranks": 2}, r"ranks = 2 is for model sp: .*ranks = 1"),
        ({"force_law": {"gamma": 0.1}}, r"model sp has no parameter"),
        ({"observables": ["void"]}, r"observables\[1\] = 'void': use one of"),
        ({"observables": ["spectra"]}, r"'spectra' needs omega"),
        ({"omega": [1.0]}, r"omega is given, but observable 'spectra' is not"),
        ({"observables": ["spectra"], "omega": [1.0], "damping": {}}, r"'spectra' needs a damping law"),
        ({"observables": ["spectra"], "omega": [-1.0]}, r"omega\[1\] = -1.0: must be above 0"),
        (
            {"observables": ["spectra"], "omega": {"lowest": 2.0, "highest": 1.0, "points": 3}},
            r"lowest = 2 is not below",
        ),
        ({"tolerances": {"max_force": 0}}, r"tolerances\.max_force = 0: must be 1e-15 or more"),
        # numbers that passed `plan`, hung or ended in a traceback
        ({"n": 10**13}, r"n\[1\] = 10000000000000: must be 1000000 or less"),
        ({"n": list(range(2, 4000, 2))}, r"n = \[2, 4, .*: the list is too long: give at most 1000"),
        ({"seeds": 10**12}, r"seeds = 1000000000000: a campaign has at most 1000000 tasks"),
        ({"seeds": 10**6, "n": [8, 16]}, r"2000000 tasks, but a campaign has at most 1000000: .* split it"),
        ({"seeds": [1, 1e300]}, r"seeds\[2\] = 1e\+300: must be a whole number$"),
        ({"observables": ["spectra"], "omega": {"lowest": 1.0, "highest": 2.0, "points": 10**12}}, r"10000 or less"),
        ({"observables": ["spectra"], "omega": [1e150]}, r"omega\[1\] = 1e\+150: must be 1e\+100 or less"),
        ({"compress": {"to": 0.9, "step": 1e-300}}, r"step = 1e-300: must be 1e-05 or more"),
        ({"model": "dp", "force_law": {"delta": 1e30}}, r"delta = 1e\+30: must lie between 1e-12 and 10"),
        ({"model": "dp", "force_law": {"gamma": 1e11}}, r"line tension shrinks a free droplet to a point"),
        *(
            ({"model": "dp", "force_law": {"nv_small": value}}, r"force_law: a polygon cannot have .* vertices")
            for value in (1e300, 1e-300, 10**400, [12], True, "x", 10001)
        ),
        ({"model": "{gt}"}, r"model\[1\] = '\{gt\}': use one of"),
    ],
)
def test_what_no_campaign_can_do_is_named_with_file_key_value_and_remedy(tmp_path, changes, message):
    path = written(tmp_path / "wrong.toml", **changes)
    with pytest.raises(InputError, match=message) as caught:
        read_campaign_file(path)
    assert all(line.startswith(f"{path}: ") for line in str(caught.value).splitlines())


@pytest.mark.parametrize("value", ["inf", "nan", "{ a = 1 }", "1979-05-27", "0x" + 400 * "f"])
@pytest.mark.parametrize("key", ["nv_small", "delta", "ka"])
def test_values_that_only_toml_can_write(tmp_path, key, value):
    path = written(tmp_path / "c.toml", model="dp", force_law={key: 12345})
    path.write_text(path.read_text().replace("12345", value))
    with pytest.raises(InputError, match=r"force_law: .*(must be a positive number|whole numbers from 3)"):
        read_campaign_file(path)


@pytest.mark.parametrize(
    ("seeds", "message"),
    [
        ("[" * 100_000, "nests brackets too deeply"),
        ("[" * 200 + "]" * 200, "must be a whole number"),
        ("9" * 5000, "is not TOML: Exceeds the limit"),
        ("0x" + "f" * 5000, "seeds = a int too long to print: a campaign has at most"),
    ],
)
def test_a_file_that_is_nested_or_long_without_end(tmp_path, seeds, message):
    path = written(tmp_path / "c.toml", seeds=12345)
    path.write_text(path.read_text().replace("12345", seeds))
    with pytest.raises(InputError, match=message) as caught:
        read_campaign_file(path)
    assert len(str(caught.value)) < 500


def test_devices_pipes_and_huge_files_are_not_read(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    with (tmp_path / "huge.toml").open("wb") as file:
        file.truncate(10**12)
    for name, message in {"/dev/zero": "not a regular", "pipe.toml": "not a regular", "huge.toml": "at most"}.items():
        with pytest.raises(InputError, match=message):
            read_campaign_file(tmp_path / name)


def test_files_that_are_no_campaign_file(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        jamlab.open_campaign(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("name = ")
    with pytest.raises(InputError, match="is not TOML"):
        jamlab.open_campaign(tmp_path / "bad.toml")
    with pytest.raises(InputError, match="no campaign has run in the folder"):
        jamlab.open_campaign(tmp_path)
    path = written(tmp_path / "c.toml")
    path.write_text(path.read_text() + path.read_text().split("\n", 1)[1])
    with pytest.raises(InputError, match=r"'disks'.*rename"):
        jamlab.open_campaign(path)
    with pytest.raises(InputError, match="has no sweep 'x': use one of disks"):
        jamlab.open_campaign(written(tmp_path / "c.toml")).plan(only=["x"])


def test_task_names_depend_on_what_results_depend_on(tmp_path):
    path = tmp_path / "c.toml"
    one = names(written(path))
    assert len(set(one)) == 2
    assert names(written(path, name="other", seeds=[2, 1])) == one[::-1]
    assert names(written(path, seeds={"first": 2, "last": 4})) == names(written(path, seeds=[2, 3, 4]))
    assert set(names(written(path, seeds=3))) > set(one)  # more seeds keep what is there
    assert set(names(written(path, n=[16, 18]))) > set(one)
    assert names(written(path, observables=["states"])) == one
    for changes in (
        {"ensemble": "shear-stabilized"},
        {"compress": {"to": 0.91, "step": 0.02}},
        {"observables": ["voids"]},
        {"tolerances": {"max_force": 1e-9}},
    ):
        assert not set(names(written(path, **changes))) & set(one)
    lists = {"compress": None, "pressures": [1e-3, 1e-2], "observables": ["spectra"], "omega": [1.0, 2.0]}
    turned = lists | {"pressures": [1e-2, 1e-3], "omega": [2.0, 1.0], "prestress": [True]}
    assert names(written(path, **lists)) == names(written(path, **turned))


def test_task_names_are_the_same_in_another_process_and_for_other_droplets_not(tmp_path):
    path = written(tmp_path / "c.toml", model="dp", force_law={"gamma": 0.1})
    code = "import sys; from jamlab.campaign.file import *; from jamlab.campaign.tasks import *\n"
    code += "print(*[t.name for b in batches(check_campaign(read_text(sys.argv[1]), 'c')) for t in b.tasks()])"
    environment = os.environ | {"PYTHONHASHSEED": "7"}
    line = [sys.executable, "-c", code, path]
    done = subprocess.run(line, capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.split() == names(path)
    task = next(batches(read_campaign_file(path))[0].tasks())
    assert task_name(Parameters.from_record(dict(reversed(task.parameters.record().items())))) == task.name
    # the defaults of the decks are part of the name: new ones make new tasks
    assert task.parameters.force_law["ka"] == defaults("dp")["ka"]
    before = set(names(path))
    assert not before & set(names(written(path, model="dp", force_law={"gamma": 0.11})))


def test_a_task_of_two_sweeps_is_done_once():
    content = CampaignTable.model_validate({"name": "c", "sweep": [SWEEP, SWEEP | {"name": "again", "seeds": 3}]})
    tasks = list(remaining_tasks(batches(content), set()))
    assert sorted(task.parameters.seed for task in tasks) == [1, 2, 3]
    assert [t.parameters.seed for t in remaining_tasks(batches(content), {tasks[0].name})] == [2, 3]


any_name = st.from_regex(r"\A[A-Za-z0-9][A-Za-z0-9_.-]{0,9}\Z")
fractions = st.floats(0.01, 1.0)
numbers = st.floats(1e-2, 1e6)
in_one_folder = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def some(strategy, most=3):
    return st.lists(strategy, min_size=1, max_size=most, unique=True)


@st.composite
def sweeps(draw):
    """One sweep with any of the keys that go together."""
    model = draw(st.sampled_from(["sp", "dp", ["sp", "dp"]]))
    disks = model == "sp"
    even = st.integers(1, 50).map(lambda k: 2 * k)
    sweep = {"name": draw(any_name), "model": model, "n": draw(even | some(even))}
    sweep["seeds"] = draw(st.integers(1, 4) | some(st.integers(0, 99)))
    protocol = draw(st.sampled_from(["compress", "onset", "pressures"] if disks else ["compress", "onset"]))
    step = draw(fractions)
    sweep |= {
        "compress": {"compress": {"to": draw(fractions), "step": step, "nearest": draw(st.floats(1e-6, 1)) * step}},
        "onset": {"onset": True},
        "pressures": {"pressures": draw(some(st.floats(1e-8, 0.3)))},
    }[protocol]
    wanted = draw(some(st.sampled_from(["states", "spectra", "correlation", "voids"] + ["quasistatic"] * disks), 5))
    sweep |= {"observables": wanted} if draw(st.booleans()) or {"spectra", "correlation"} & set(wanted) else {}
    for observable, key in (("spectra", "omega"), ("correlation", "correlation_omega")):
        if observable in wanted:
            grid = st.fixed_dictionaries({"lowest": st.just(1e-3), "highest": numbers, "points": st.integers(2, 5)})
            sweep[key] = draw(some(numbers) | grid)
    if draw(st.booleans()):
        strengths = st.floats(0, 10)
        sweep["damping"] = {"contact": draw(some(strengths)), "stokes": draw(st.lists(strengths, max_size=2))}
    if disks and draw(st.booleans()):
        sweep["prestress"] = draw(st.sampled_from([True, False, [True, False], [False]]))
    if model == "dp" and draw(st.booleans()):
        sweep["force_law"] = {"gamma": draw(st.floats(0.01, 1.0))}
    if draw(st.booleans()):
        sweep["tolerances"] = {"spectrum_error": draw(fractions)}
    return sweep


@st.composite
def files(draw):
    listed = st.lists(sweeps(), min_size=1, max_size=3, unique_by=lambda sweep: sweep["name"])
    return {"name": draw(any_name), "sweep": draw(listed)}


def toml(content):
    """The file, keys in the order of the dict."""
    lines = [f"name = {campaigns.toml(content['name'])}"]
    for sweep in content["sweep"]:
        lines += ["[[sweep]]", *(f"{key} = {campaigns.toml(value)}" for key, value in sweep.items())]
    return "\n".join(lines) + "\n"


def tasks(table):
    return [task.name for batch in batches(table) for task in batch.tasks()]


def turned(value, order):
    """The same tables with their keys in another order."""
    if isinstance(value, dict):
        return {key: turned(value[key], order) for key in order.sample(list(value), len(value))}
    return [turned(entry, order) for entry in value] if isinstance(value, list) else value


@in_one_folder
@given(content=files(), order=st.randoms(use_true_random=False))
def test_files_survive_being_written_in_any_order(tmp_path, content, order):
    path = tmp_path / "c.toml"
    path.write_text(toml(content))
    read = read_campaign_file(path)
    assert read == CampaignTable.model_validate(content)
    path.write_text(toml(turned(content, order)))
    assert tasks(read_campaign_file(path)) == tasks(read)
    assert len(set(tasks(read))) >= len(read.sweep[0].n) * len(read.sweep[0].seeds)


@in_one_folder
@given(content=files())
def test_checked_content_written_out_is_the_same_campaign(tmp_path, content):
    """Every default spelled out."""
    read = CampaignTable.model_validate(content)
    spelled = read.model_dump(exclude_none=True)
    spelled.pop("slurm")
    for sweep in spelled["sweep"]:
        sweep["seeds"] = list(sweep["seeds"])
    (tmp_path / "c.toml").write_text(toml(spelled))
    assert tasks(read_campaign_file(tmp_path / "c.toml")) == tasks(read)


@given(content=files())
def test_one_more_seed_adds_tasks_and_renames_none(content):
    longer = {**content, "sweep": [sweep | {"seeds": 5} for sweep in content["sweep"]]}
    shorter = {**content, "sweep": [sweep | {"seeds": 4} for sweep in content["sweep"]]}
    few, many = (tasks(CampaignTable.model_validate(c)) for c in (shorter, longer))
    assert set(few) < set(many)
    assert len(many) == pytest.approx(1.25 * len(few))


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"compress": None, "pressures": [1e-2, 0.3], "force_law": {"exponent": 2.5}}, "0.3"),
        ({"compress": None, "pressures": [1e-6], "tolerances": {"max_force": 1e-9}}, "1e-06"),
        ({"model": "dp", "force_law": {"ka": 1e7}}, "1e+07"),
        ({"observables": ["spectra"], "omega": [1.0], "damping": {"contact": [1e99]}}, "1e+99"),
        ({"observables": ["flow"], "flow": {"rates": [0.1]}, "damping": {"contact": [1e7]}}, "1e+07"),
        ({"observables": ["creep"], "creep": {"stresses": [0.1], "duration": 1.0}, "damping": {"stokes": [0.0]}}, "0"),
        ({"observables": ["creep"], "creep": {"stresses": [1e9], "duration": 1.0}}, "1e+09"),
        ({"observables": ["oscillation"], "oscillation": {"omega": [1e-9], "amplitudes": [0.1]}}, "1e-09"),
        ({"observables": ["oscillation"], "oscillation": {"omega": [1.0], "amplitudes": [1e-13]}}, "1e-13"),
    ],
)
def test_what_every_task_would_refuse_is_refused_before_any_runs(tmp_path, changes, named):
    with pytest.raises(InputError) as caught:
        read_campaign_file(written(tmp_path / "c.toml", **changes))
    assert named in str(caught.value)
