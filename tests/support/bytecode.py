"""Keep the bytecode of what tests import where the environment keeps none and the installer left none: each of a
hundred processes that tests start would compile NumPy, SciPy and pandas again, 1 to 3 s of CPU time. Imported first by
`tests/conftest.py`."""

import os
import sys
from importlib.util import cache_from_source, find_spec
from pathlib import Path

FOLDER = Path(__file__).parents[2] / ".pytest_cache" / "bytecode"

if sys.dont_write_bytecode and not os.path.exists(cache_from_source(str(find_spec("numpy").origin))):
    sys.dont_write_bytecode, sys.pycache_prefix = False, str(FOLDER)
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = str(FOLDER)
