"""Campaigns: ensembles of packings, thousands of tasks, described by one file, on a laptop or a cluster.

A campaign file (`file.py`) lists sweeps; each becomes tasks (`tasks.py`), one packing each. They are cut into chunks of
seeds (`chunks.py`), which the driver (`driver.py`) hands to workers (`workers.py`). A worker makes the states of a task
or takes those of another task (`states.py`), measures them (`observables.py`, `flow_observables.py`) and writes a file
of one task (`task_file.py`) or several (`chunk_file.py`) into the folder of the campaign (`folder.py`). There it marks
what it is at (`marks.py`), so that tasks that end their workers are found (`deaths.py`). `standing.py` says how far a
run is, `plan.py` what is left and what that takes; `tables.py` collects and averages. `campaign.py` ties this together
for Python, `running.py` for notebooks; `open_campaign.py` loads it once there is a text (`campaign_text.py`) to check.
"""
