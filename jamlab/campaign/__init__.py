"""Campaigns: ensembles of packings, thousands of tasks, described by one file, on a laptop or a cluster.

A campaign file (`file.py`) lists sweeps; each becomes tasks (`tasks.py`), one packing each, which workers run
(`workers.py`). A worker makes the states of a task or takes those of another task (`states.py`), measures them
(`observables.py`, `flow_observables.py`) and writes one HDF5 file into the folder of the campaign (`folder.py`).
`plan.py` says what is left and what that takes; `tables.py` collects and averages. `campaign.py` ties this together
for Python.
"""
