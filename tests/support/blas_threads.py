"""One thread for linear algebra, unless the environment asks for more: tests have a process for every core, and threads
that wait for each other took half of the CPU time of eigenvalues. Imported before NumPy by `tests/conftest.py`."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
