"""Workers of clusters: jobs of a batch system, or a running Dask scheduler; all that imports Dask.

`cluster.py` gives the executor of either one. For a batch system it sends jobs as the site wants them (`site.py`), with
keys that only their user can read (`keys.py`), and keeps them at work (`batch_jobs.py`, `batch_system.py`). In a job
`batch_worker.py` starts workers.
"""
