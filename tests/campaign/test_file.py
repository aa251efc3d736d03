"""Campaign files: what is valid survives being written and read, what is not is named; names of tasks."""

import pickle

import pytest
from campaigns import SWEEP, names, read_campaign_file, written

import jamlab
from jamlab.campaign import file, wrong_keys
from jamlab.campaign.file import CampaignTable
from jamlab.campaign.tasks import Batch, Parameters, batches, task_names, tasks_named
from jamlab.engine.deck_defaults import defaults
from jamlab.errors import InputError

STOKES = {"damping": {"stokes": [1.0]}}
FLOWS = {
    "flow": {"rates": [0.1]},
    "quasistatic_shear": {},
    "oscillation": {"omega": [1.0], "amplitudes": [0.1]},
    "cyclic_shear": {"amplitudes": [0.1]},
}


def flows(name, **changes):
    return {"observables": [name], name: FLOWS[name] | changes}


def pressed(*pressures, **more):
    return {"compress": None, "pressures": list(pressures), **more}


def spectra(omega, **more):
    return {"observables": ["spectra"], "omega": omega, **more}


def sticky():
    return {"law": {"stickiness": 0.05}}


def droplets(**law):
    return {"model": "dp", "law": law}


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        # what pydantic checks, with place, value and limit
        ({"model": "{gt}"}, "sweep[1].model[1] = '{gt}'"),
        ({"n": 0}, "sweep[1].n[1] = 0"),
        ({"n": 10**13}, "n[1] = 10000000000000"),
        ({"ranks": 2.5}, "ranks = 2.5"),
        ({"compress": 0.9}, "compress = 0.9"),
        ({"compress": {"step": 0.1}}, "to is missing"),
        ({"compress": {"to": 0.9, "above_onset": 0.01}}, "to and above_onset are given"),
        ({"compress": {"above_onset": 0}}, "compress.above_onset = 0"),
        ({"compress": {"above_onset": 0.9, "step": 1e-6}}, "step = 1e-06"),
        ({"compress": {"to": 0.9, "step": 1e-300}}, "step = 1e-300"),
        ({"seed": 3}, "did you mean seeds"),
        (spectra([1e150]), "omega[1] = 1e+150"),
        (flows("flow", speed=1), "flow.speed"),
        # seeds, in all of their forms
        *(({"seeds": value}, f"seeds = {value}") for value in (0, True, 10**12, [1, 2, 1])),
        ({"seeds": {"first": 5, "last": 4}}, "first = 5"),
        ({"seeds": {"first": 5}}, "seeds.last"),
        ({"seeds": {"first": 5, "last": 10**12}}, "5 to 1000000000000"),
        ({"seeds": 10**6, "n": [8, 16]}, "2000000 tasks"),
        # combinations of keys
        ({"n": 15}, "n = 15"),
        ({"compress": None}, "sweep[1]: give exactly one of compress, pressures, phi and onset"),
        ({"pressures": [0.01]}, "compress and pressures"),
        ({"compress": {"to": 1.2}}, "to = 1.2"),
        ({"compress": {"to": 0.9, "first_step": 0.1}}, "first_step = 0.1"),
        ({"compress": None, "phi": [0.8], "model": "dp"}, "give droplets a separate sweep with compress or onset"),
        (pressed(0.01, model=["sp", "dp"]), "pressures"),
        ({"compress": {"to": [0.9, 0.95]}}, "compress.to = [0.9, 0.95]: takes one value: give each value a sweep"),
        (pressed(0.01, decompress=True), "decompress"),
        ({"decompress": True}, "decompress"),
        ({"model": "dp", "prestress": False}, "prestress"),
        ({"model": "dp", "ranks": 2}, "ranks = 2"),
        ({"model": "dp", "observables": ["quasistatic"]}, "quasistatic"),
        ({"observables": ["modes"]}, "modes"),
        ({"model": "dp", "observables": ["modes"], "damping": {}}, "damping"),
        ({"model": "dp", "n": 128, "observables": ["modes"]}, "1856"),
        ({"observables": ["void"]}, "'void'"),
        ({"observables": ["G"]}, "g is a column of the table 'states'"),
        ({"observables": ["spectra"]}, "omega"),
        ({"omega": [1.0]}, "spectra"),
        (spectra([1.0], damping={}), "damping"),
        (spectra({"lowest": 2.0, "highest": 1.0, "points": 3}), "lowest = 2"),
        *(({"sizes": value}, str(value)) for value in ("wide", "from-file:d.txt")),
        ({"sizes": [1.0, 2.0]}, "2 diameters"),
        ({"observables": ["flow"]}, "flow"),
        ({"observables": ["oscillation"], **{"flow": FLOWS["flow"]}}, "flow"),
        # what would be ignored
        ({"damping": {"contact": [2.0]}}, "damping is given, but no observable"),
        ({"prestress": [False]}, "prestress is given, but no observable"),
        (pressed(0.01, tolerances={"max_force": 1e-10}), "tolerances: unknown key, did you mean force_tolerance?"),
        (pressed(0.01, force_law={"exponent": 2.5}), "force_law: unknown key, did you mean law?"),
        ({"compress": {"to": 0.9, "nearest": 1e-4}}, "compress.nearest: unknown key, did you mean first_step?"),
        ({"compress": {"to": 0.9, "step_error": 0.1}}, "step_error: unknown key, did you mean pressure_tolerance?"),
        (pressed(0.01, pressure_tolerance=0.1), "pressure_tolerance: unknown key, it is a key of compress"),
        (pressed(0.01, search="incremental"), "search = 'incremental': the protocol 'pressure' has none"),
        ({"search": "incremental", "ensemble": "shear-stabilized"}, "incremental"),
        ({"model": "dp", "units": "k"}, "units = 'k'"),
        ({"model": "dp", "size_ratio": 1.4}, "size_ratio = 1.4"),
        ({"start": "direct"}, "start = 'direct'"),
        ({"size_ratio": 1.4, "sizes": "lognormal:0.2"}, "give one of them"),
        ({"compress": {"to": 0.9, "step": 1e-7}}, "step = 1e-07"),
        ({"law": "hertzian"}, "hertzian"),
        ({"size_ratio": 11.0}, "size_ratio = 11"),
        *((flows("flow", **{key: 0.5}) | STOKES, f"flow.{key}") for key in ("alpha", "background_drag")),
        # what every task would refuse
        *(({"compress": how, "onset": not how or None, **sticky()}, "sticky disks") for how in (None, {"to": 0.9})),
        (flows("quasistatic_shear", strain_step=0.1, strain=1.0), "quasistatic_shear.strain_step = 0.1"),
        (droplets(gama=1.0), "'gama'"),
        (droplets(ka=-1.0), "-1.0"),
        (droplets(delta=1e30), "params['delta'] is 1e+30"),
        (droplets(ka=1e7), "1e+07"),
        *((droplets(nv_small=value), "vertices") for value in (1e300, 1e-300, 10**400, [12], True, "x", 10001)),
        ({"law": {"gamma": 0.1}}, "'gamma'"),
        (pressed(1e-2, 0.3, law={"exponent": 2.5}), "0.3"),
        (pressed(1e-6, force_tolerance=1e-9), "1e-06"),
        (spectra([1.0], damping={"contact": [1e99]}), "1e+99"),
        (flows("flow") | {"damping": {"contact": [1e7]}}, "1e+07"),
        (flows("flow", rates=[1e4]), "10000"),
        (flows("flow", rates=[0.1, 1e-13]), "1e-13"),
        (flows("flow", rates=[0.0]), "observable 'quasistatic_shear'"),
        (flows("oscillation", omega=[1e-9]), "1e-09"),
        (flows("oscillation", amplitudes=[9.0]), "9"),
        (flows("cyclic_shear", amplitudes=[9.0]), "9"),
        (flows("cyclic_shear", strain_step=0.1, amplitudes=[0.05]), "above the amplitude 0.05"),
        (flows("cyclic_shear", cycles=0), "cycles"),
    ],
)
def test_what_no_campaign_can_do_is_named_before_any_task_runs(tmp_path, changes, named):
    """Every problem in a line that begins with the file, and names the key or the value."""
    path = written(tmp_path / "wrong.toml", **changes)
    with pytest.raises(InputError) as caught:
        read_campaign_file(path)
    assert named in str(caught.value)
    assert all(line.startswith(f"{path}: ") for line in str(caught.value).splitlines())


SWEEP_TEXT = '[[sweep]]\nname = "s"\nmodel = "sp"\nn = 8\nseeds = 1\nonset = true\n'
UNKNOWN = [  # text, and what is said of its unknown key
    ("[campaign]\n", "campaign: unknown key, did you mean name? Keys here: name, sweep"),
    ("n = 8\n", "n: unknown key, it is a key of sweep. Keys here: name, sweep"),
    (f"{SWEEP_TEXT}to = 0.9\n", "sweep[1].to: unknown key, it is a key of compress. Keys here: name, model, n,"),
    (f"{SWEEP_TEXT}threads = 2\n", "sweep[1].threads: unknown key, did you mean ranks?"),
    (f"{SWEEP_TEXT}nearest = 1e-4\n", "nearest: unknown key, did you mean first_step, a key of compress?"),
    (f"{SWEEP_TEXT}workers = 2\n", "workers: unknown key: give it to the run, as jamlab campaign run --workers"),
    (f'{SWEEP_TEXT}observables = "gstar"\n', "use 'spectra', or another of 'states'"),
    (f'{SWEEP_TEXT}observables = "dos"\n', "use jamlab.density_of_states(campaign)"),
    (f"{SWEEP_TEXT}damping = {{ beta = [1.0] }}\n", "damping.beta: unknown key, did you mean contact?"),
    (f"{SWEEP_TEXT}omega = {{ min = 1.0 }}\n", "omega.min: unknown key, did you mean lowest? Keys here: lowest,"),
    (f"{SWEEP_TEXT}flow = {{ rate = [1.0] }}\n", "flow.rate: unknown key, did you mean rates?"),
    (f"{SWEEP_TEXT}qqq = 2\n", "sweep[1].qqq: unknown key, leave it out. Keys here: name, model, n, seeds,"),
    ("[sweep]\nn = 8\n", "sweep: write [[sweep]]"),
    ("", "name: is missing"),
]


@pytest.mark.parametrize(("text", "said"), UNKNOWN)
def test_hints_name_keys_of_the_same_table_or_the_table_that_has_the_key(tmp_path, text, said):
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        read_campaign_file(tmp_path / "c.toml")
    assert said in str(caught.value)


def test_hints_lead_to_keys_that_exist():
    """Of every table: its own keys are known, and words for them are no keys of it."""
    tables = list(wrong_keys._keys_of_tables(CampaignTable, file._PLAIN))
    held_by = {"", "sweep", "seeds", "compress", "damping", "omega", "rates", "flow", "oscillation"}
    assert held_by <= {holder for holder, _ in tables}
    assert wrong_keys._ALSO_CALLED.keys() <= {key for _, keys in tables for key in keys}
    everywhere = dict(tables)
    for _, keys in tables:
        for key in keys:
            for word in set(wrong_keys._words(key)) - set(keys):
                said = wrong_keys._explain_unknown(word, keys, everywhere)
                assert said.partition("did you mean ")[2].partition("?")[0] in keys, (word, said)


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path):
    path = written(tmp_path / "c.toml")
    path.write_bytes("\ufeff".encode() + path.read_bytes())
    assert read_campaign_file(path).name == "c"


@pytest.mark.parametrize("seeds", ["[" * 100_000, "[" * 200 + "]" * 200, "9" * 5000, "0x" + "f" * 5000])
def test_a_file_that_is_nested_or_long_without_end(tmp_path, seeds):
    path = written(tmp_path / "c.toml", seeds=12345)
    path.write_text(path.read_text().replace("12345", seeds))
    with pytest.raises(InputError) as caught:
        read_campaign_file(path)
    assert len(str(caught.value)) < 500


def test_files_that_are_no_campaign_file(tmp_path):
    """Devices and huge files are not read either."""
    with (tmp_path / "huge.toml").open("wb") as stream:
        stream.truncate(10**12)
    (tmp_path / "bad.toml").write_text("name = ")
    path = written(tmp_path / "twice.toml")
    path.write_text(path.read_text() + path.read_text().split("\n", 1)[1])
    for name in ("/dev/zero", "huge.toml", "none.toml", "bad.toml", "", "twice.toml"):
        with pytest.raises(InputError) as caught:
            jamlab.open_campaign(tmp_path / name)
        assert str(tmp_path / name) in str(caught.value)
    with pytest.raises(InputError):
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
        {"sizes": "lognormal:0.3"},
        {"compress": {"to": 0.91, "step": 0.02}},
        {"compress": {"above_onset": 0.9, "step": 0.02}},
        {"observables": ["voids"]},
        {"force_tolerance": 1e-9},
    ):
        assert not set(names(written(path, **changes))) & set(one)
    lists = {"compress": None, "pressures": [1e-3, 1e-2], "observables": ["spectra"], "omega": [1.0, 2.0]}
    turned = lists | {"pressures": [1e-2, 1e-3], "omega": [2.0, 1.0], "prestress": [True]}
    assert names(written(path, **lists)) == names(written(path, **turned))


def test_names_of_tasks_survive_their_files_and_depend_on_the_defaults_of_the_decks(tmp_path):
    path = written(tmp_path / "c.toml", model="dp", law={"gamma": 0.1})
    task = next(batches(read_campaign_file(path))[0].tasks())
    read = Parameters.model_validate_json(task.parameters.model_dump_json())
    assert Batch("", read, [1]).name_of(read.seed) == task.name
    assert task.parameters.law["ka"] == defaults("dp")["ka"]
    # what affects speed only, or when to give up, is no part of a name
    assert {"longest_edge", "units"}.isdisjoint(read.law) and "increment_least" not in read.decks
    before = set(names(path))
    assert not before & set(names(written(path, model="dp", law={"gamma": 0.11})))


def test_a_sweep_that_ends_at_a_packing_fraction_is_written_without_a_distance():
    """Tasks of such sweeps keep the names that they had before there was one."""
    content = CampaignTable.model_validate({"name": "c", "sweep": [SWEEP]})
    (batch,) = batches(content)
    assert "above_onset" not in batch.parameters.model_dump(mode="json")["compress"]


def test_the_first_step_may_be_as_long_as_the_others(tmp_path):
    assert read_campaign_file(written(tmp_path / "c.toml", compress={"to": 0.9, "step": 0.01, "first_step": 0.01}))


def test_a_task_of_two_sweeps_is_done_once():
    content = CampaignTable.model_validate({"name": "c", "sweep": [SWEEP, SWEEP | {"name": "again", "seeds": 3}]})
    names = task_names(batches(content))
    tasks = list(tasks_named(batches(content), names))
    assert sorted(task.parameters.seed for task in tasks) == [1, 2, 3]
    assert [t.parameters.seed for t in tasks_named(batches(content), names - {tasks[0].name})] == [2, 3]


def test_a_chunk_is_sent_small_and_names_its_tasks_alike(tmp_path):
    """The parameters once, whatever the number of seeds; names before or after make no difference."""
    (batch,) = batches(read_campaign_file(written(tmp_path / "c.toml", seeds=1000)))
    names, bare = list(batch.names()), len(pickle.dumps(Batch("", batch.parameters, [])))
    for seeds in (batch.seeds[5:900], [3, 700, 12]):
        sent = pickle.dumps(batch.part(seeds))
        chunk = pickle.loads(sent)
        assert list(chunk.names()) == [names[seed - 1] for seed in seeds]
        assert [task.parameters.seed for task in chunk.tasks()] == list(seeds) and chunk == batch.part(seeds)
        assert len(sent) < bare + 100
