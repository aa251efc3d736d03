"""Campaigns: ensembles of packings, thousands of tasks, from one file, on a laptop or a cluster.

| file                | one idea                                                        |
|---------------------|-----------------------------------------------------------------|
| `campaign_file.py`  | the TOML file: what it may say, and what is wrong with it       |
| `tasks.py`          | sweeps into tasks; the name of a task                           |
| `sweep_states.py`   | the packings of one task                                        |
| `sweep_tables.py`   | what is measured on them                                        |
| `task_file.py`      | one task in one HDF5 file, with its checksum                    |
| `folder.py`         | finished, failed and damaged tasks in a folder; its lock        |
| `worker.py`         | one task from start to file                                     |
| `workers.py`        | Dask: this machine, a scheduler's address, SLURM                |
| `worker_supply.py`, `worker_process.py` | worker processes here, alive as long as the driver  |
| `driver.py`         | tasks through workers, a bounded number at a time               |
| `plan.py`           | time and bytes before anything runs                             |
| `tables.py`         | files into tidy tables                                          |
| `aggregate.py`      | means and intervals over packings                               |
| `campaign.py`       | all of it from Python: `jamlab.open_campaign`                   |
| `exchange.py`       | merge folders, export tables and frames                         |
| `cli.py`            | the command line                                                |
| `progress.py`       | what it shows while tasks run                                   |
| `walkthrough.py`    | one campaign from Python, step by step                          |
| `reference.toml`    | the campaign of the reference data                              |
"""
