"""Stored tasks are found by their names: one of every sweep that ships, as it was named in version 0.2.0."""

from importlib.resources import files
from pathlib import Path

import pytest

from jamlab.campaign.file import check_campaign, read_campaign_file
from jamlab.campaign.states import make_states
from jamlab.campaign.tasks import Parameters, batches
from jamlab.errors import InputError

NAMES = {  # file -> sweep, model, n, seed -> name of the task
    "reference": {
        ("spectra", "sp", 2048, 1): "36c8a13cd8dee0a39a8ad40336832240",
        ("damping", "sp", 2048, 1): "c0414102cd168598b282ece442d718f9",
        ("correlation", "sp", 2048, 1): "e81613ae40b4689f97ea8b63622e3bfe",
        ("droplets", "dp", 32, 1): "b19306e084c2d436fb08c8e74491bd11",
        ("droplet-onsets", "dp", 16, 1): "00a960a394da0d63f9c2dc5b597ccb38",
        ("droplet-onsets-small", "dp", 32, 101): "93cf082487ae094fc3e3190ab9d457c7",
        ("droplet-onsets-128", "dp", 128, 51): "ceb88386470c7d712774ce7ebc2eef36",
        ("droplet-onsets-256", "dp", 256, 21): "75b8e44ab9282b3d3105750667c7e8e7",
        ("disks-1024", "sp", 1024, 1): "0de8675eaed27d0596bd8044834bca61",
        ("droplets-64", "dp", 64, 1): "87ecbc506c6e7d0ebcbc59e3a600629d",
        ("disks", "sp", 32, 1): "55e31524d74f083e4ec432ed64934043",
        ("droplets-128", "dp", 128, 1): "fa687cb9a67589d470d4fb3c29af63a4",
        ("size", "sp", 32, 1): "0341e1f204d94caa6adde242af7eed25",
        ("spectra-large", "sp", 8192, 1): "3accf2136cf84611016fdabab6301c4a",
        ("stabilized", "sp", 8192, 1): "f54a7494e3d8d49228accb0bbca9108b",
        ("correlation-large", "sp", 8192, 1): "666829c143ff23f4d5b411b3a36d3023",
        ("correlation-largest", "sp", 32768, 1): "486e0e0c4f3a01c4105f927884e8247c",
        ("droplets-256", "dp", 256, 1): "26d48d6d3d47b3ec127441f0b38c9e5a",
    },
    "dynamics": {
        ("quasistatic", "sp", 256, 1): "26d571d4b252472a3d98eeba3a89f874",
        ("flow-curves", "sp", 256, 1): "7a00510d51dee609e2f04ebca32fc292",
        ("onset", "sp", 256, 1): "b80f681acb9819f9955e4ea30fed5f3c",
        ("onset-slow", "sp", 256, 1): "34122d06a1e77d476c764554dcc74134",
        ("slow-flow", "sp", 256, 1): "7d194eca33086a6258942a0b488d6def",
        ("slowest-flow", "sp", 256, 1): "8d5ded41a9b9d040f7f757614346b0df",
        ("power-law-half", "sp", 256, 1): "6de148b94362b4504aa14de06463a04e",
        ("power-law-two-thirds", "sp", 256, 1): "3a871ca0ed69c4024ddf5d3f206e9281",
        ("check-size", "sp", 64, 1): "f48e287e4f8456757d0ecd473e19c395",
        ("check-size-linear", "sp", 64, 1): "f311ace71f8ae0496fbc08061f375ac5",
        ("check-background", "sp", 64, 1): "1e6e2a7029dfbb81f306cf5720f192bd",
        ("check-background-linear", "sp", 64, 1): "503feb88714d66d4877b99e4493c24a6",
        ("check-tolerance", "sp", 64, 1): "590fb005b22281459d5d3a8736d5dae5",
        ("check-tolerance-linear", "sp", 64, 1): "c096b8625c0acc543651b6c8469122a2",
        ("creep", "sp", 256, 1): "e5d7476381ed6c63b40f39f7eb6e8249",
        ("amplitudes", "sp", 64, 1): "865783cf0c1202d84b4aa4791651d39b",
        ("equivalent-0.5", "sp", 64, 1): "2c9cb44bef108279d3300bdfb2b95be9",
        ("equivalent-0.6", "sp", 64, 1): "5367dfb9cfc600186243b3240555f1e8",
        ("equivalent-0.75", "sp", 64, 1): "93b31d07807f17f899e9aa38f8e7cc5c",
        ("equivalent-0.9", "sp", 64, 1): "d585d5331748405623ec61600d233b7b",
        ("equivalent-1", "sp", 64, 1): "a850a29985171ad5e08438bbd4edfffc",
        ("droplets-0.90", "sp", 16, 1): "680c6db2ed56afe7e54b5e3540115c13",
        ("droplets-0.95", "sp", 16, 1): "ef5f4b94b7c34b5fcaa6514ffda624c5",
    },
    "beyond_the_papers": {
        ("droplet-spectra", "dp", 32, 1): "8250affc768989c632b0d285fb4e3de2",
        ("disk-spectra", "sp", 32, 1): "74b7ac3aa6dfc348c9d99fd31c0a6195",
        ("tension-0.04", "dp", 32, 1): "34e4d29d8eb58de9b7fd3bc9d8d5133b",
        ("tension-0.126", "dp", 32, 1): "4f4a99c31c7395f84df1bc31862946df",
        ("tension-1.26", "dp", 32, 1): "cb1c669fe687f01bdb90996329baea1b",
        ("tension-4", "dp", 32, 1): "a293874efa634e45fa14f5588a409cbb",
        ("vertices-12", "dp", 16, 1): "1e0651cc7efdfef15aa0afe0319d77c5",
        ("vertices-24", "dp", 16, 1): "656cbde1119161579f1c07032c13d012",
        ("vertices-48", "dp", 16, 1): "2dd1f165e7cdb149a33e25db29ee9d9f",
        ("stiff-rims", "dp", 16, 1): "613f1d549c397d16bb67c2a94bff3bb7",
    },
}


@pytest.mark.parametrize("name", NAMES)
def test_names_of_stored_tasks_stay(name):
    campaign = read_campaign_file(Path(str(files("jamlab.campaign"))) / f"{name}.toml")
    found = {(b.sweep, b.parameters.model, b.parameters.n): b for b in batches(campaign)}
    pinned = NAMES[name]
    assert {key: found[key[:3]].name_of(key[3]) for key in pinned} == pinned


def test_sizes_enter_the_names_of_tasks_only_where_they_are_given():
    text = 'name = "s"\n[[sweep]]\nname = "d"\nmodel = "sp"\nn = 4\nseeds = 1\nonset = true\n'

    def first(extra):
        batch = batches(check_campaign(text + extra, "s.toml"))[0]
        assert Parameters.from_record(batch.parameters.record()) == batch.parameters
        return batch

    plain, named = first(""), first('sizes = "lognormal:0.3"\n')
    given = first("sizes = [1.0, 1.5, 0.5, 1.0]\n")
    assert "sizes" not in plain.parameters.record()
    assert len({batch.name_of(1) for batch in (plain, named, given)}) == 3
    states = make_states(given.parameters)
    assert states.packings[0].diameters.tolist() == [1.0, 1.5, 0.5, 1.0]


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ('sizes = "wide"', r"sizes = 'wide': use one of"),
        ("sizes = [1.0, 2.0]", r"sizes hold 2 diameters for n = 4 disks: give n = 2"),
        ('sizes = "from-file:d.txt"', r"write the diameters as a list, since files may change"),
    ],
)
def test_sizes_that_no_campaign_can_have_are_named(extra, message):
    text = 'name = "s"\n[[sweep]]\nname = "d"\nmodel = "sp"\nn = 4\nseeds = 1\nonset = true\n'
    with pytest.raises(InputError, match=message):
        check_campaign(text + extra, "s.toml")
