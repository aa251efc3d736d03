"""Campaign files: what is valid survives being written and read; the order of keys changes no name of a task."""

import campaigns
import pytest
from campaigns import read_campaign_file
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from jamlab.campaign.file import CampaignTable
from jamlab.campaign.tasks import batches

names = st.from_regex(r"\A[A-Za-z0-9][A-Za-z0-9_.-]{0,9}\Z")
fractions = st.floats(0.01, 1.0)
in_one_folder = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def some(strategy, most=3):
    return st.lists(strategy, min_size=1, max_size=most, unique=True)


@st.composite
def sweeps(draw):
    """One sweep with any of the keys that go together."""
    model = draw(st.sampled_from(["sp", "dp", ["sp", "dp"]]))
    disks = model == "sp"
    sweep = {
        "name": draw(names),
        "model": model,
        "n": draw(st.integers(1, 50).map(lambda k: 2 * k) | some(st.integers(1, 50).map(lambda k: 2 * k))),
        "seeds": draw(st.integers(1, 4) | some(st.integers(0, 99))),
    }
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
            grid = st.fixed_dictionaries({"lowest": st.just(1e-3), "highest": numbers(), "points": st.integers(2, 5)})
            sweep[key] = draw(some(numbers()) | grid)
    if draw(st.booleans()):
        sweep["damping"] = {
            "contact": draw(some(st.floats(0, 10))),
            "stokes": draw(st.lists(st.floats(0, 10), max_size=2)),
        }
    if disks and draw(st.booleans()):
        sweep["prestress"] = draw(st.sampled_from([True, False, [True, False], [False]]))
    if model == "dp" and draw(st.booleans()):
        sweep["force_law"] = {"gamma": draw(st.floats(0.01, 1.0))}
    if draw(st.booleans()):
        sweep["tolerances"] = {"spectrum_error": draw(fractions)}
    return sweep


def numbers():
    return st.floats(1e-2, 1e6)


@st.composite
def files(draw):
    return {
        "name": draw(names),
        "sweep": draw(st.lists(sweeps(), min_size=1, max_size=3, unique_by=lambda sweep: sweep["name"])),
    }


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
