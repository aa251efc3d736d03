"""One campaign from Python, step by step: `python docs/examples/campaign.py FOLDER`.

Disks of two sizes of packing, from onset up, and their G*(omega) at two pressures; about half a minute on two cores.
Run it twice: the second time nothing is left to do.
"""

import argparse
from pathlib import Path

import numpy as np

import jamlab
from jamlab.storage.atomic_file import make_folder

CAMPAIGN = """
name = "walkthrough"

[[sweep]]
name = "compressed"
model = "sp"
n = [16, 32]
seeds = {seeds}
compress = {{ by = "phi", to = 0.95, step = 0.02, first_step = 1e-4 }}
observables = ["states", "voids"]

[[sweep]]
name = "sheared"
model = "sp"
n = 32
seeds = {seeds}
ensemble = "shear-stabilized"
pressures = [1e-2, 1e-3]
observables = ["states", "spectra"]
damping = {{ contact = [1.0], stokes = [1.0] }}
omega = {{ lowest = 1e-4, highest = 1e1, points = 6 }}
"""


def walk(folder: Path, workers: int | None = None, seeds: int = 6) -> None:
    """Write the campaign file into a folder, run it, and print what comes out.

    Args:
        folder: made if needed.
        workers: processes, by default as many as there are cores.
        seeds: packings of each kind.
    """
    # a campaign is a file; jamlab/campaign/file.py and observables.py list everything it may contain
    make_folder(folder)
    path = folder / "walkthrough.toml"
    path.write_text(CAMPAIGN.format(seeds=seeds), encoding="utf-8")
    campaign = jamlab.open_campaign(path)

    # what it will take, by one task of each kind
    campaign.run(workers, pilot=True)
    for line in campaign.plan():
        print(f"{line.sweep:12s} n = {line.n:3d}: {line.left} of {line.tasks} tasks left, {line.seconds:.0f} s")

    # run it; kill it when you like, and call it again
    done = campaign.run(workers, done=lambda o: print(f"{o.state:9s} {o.line}, {o.seconds:.1f} s"))
    print(f"{done.finished} tasks now, {campaign.status().finished} in all")

    # every state of every packing is a row
    states = campaign.table("states", sweep="compressed")
    print(states[["n", "seed", "state", "rho_J", "rho", "z", "g", "pressure", "converged"]].head())

    # means over packings, with intervals from bootstrap over packings
    edges = np.geomspace(1e-4, 0.2, 8)
    print(campaign.aggregate(["z", "g"], by=["n"], along="d_phi", bins=edges, sweep="compressed").to_string())
    print(campaign.aggregate(["rho_J"], by=["n"], table="onset").to_string())

    # spectra; rows where a packing is unstable are nan and not converged
    curves = campaign.aggregate(["storage", "loss"], by=["damping", "target_pressure", "omega"], table="spectra")
    print(curves.to_string())

    # the packings themselves
    task = campaign.finished(sweep="compressed")[0]
    densest = campaign.packings(task)[-1]
    print(f"task {task}: {densest.n} disks at phi = {densest.phi:.3f}, z = {jamlab.contacts(densest).z:.3f}")


if __name__ == "__main__":
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("folder", nargs="?", type=Path, default=Path("walkthrough"), help="made if it is not there")
    walk(words.parse_args().folder)
