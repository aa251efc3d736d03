"""Run a command of the studies from a checkout: `python -m studies list`."""

from jamlab.cli.interruption import interrupt_on_signals
from studies.commands import app

if __name__ == "__main__":
    interrupt_on_signals()
    app(prog_name="python -m studies")
