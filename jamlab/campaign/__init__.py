"""Campaigns: ensembles of packings, thousands of tasks, described by one file, on a laptop or a cluster.

A campaign file (`file.py`) lists sweeps; each sweep becomes tasks (`tasks.py`), one packing each; a worker makes the
states of a task (`states.py`) or takes those of another task (`stored_states.py`), measures them (`measurements.py`,
`own_observables.py`) and writes one HDF5 file (`task_file.py`) into the folder of the campaign (`folder.py`); seeds may
be added until means are known well enough (`standard_error.py`). `plan.py` and `cost.py` say what it takes.
`campaign.py` ties this together for Python; `reference.toml` is the campaign behind the reference data.
"""
