"""Run a command of the studies from a checkout: `python -m studies list`."""

from jamlab.cli.interruption import ending_on_signals

if __name__ == "__main__":
    with ending_on_signals() as imports_are_done:
        from studies.commands import app

        imports_are_done()
        app(prog_name="python -m studies")
