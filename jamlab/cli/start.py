"""Start the command `jamlab`; imports come last, so that a signal ends them with one line too."""

from jamlab.cli.interruption import ending_on_signals


def main() -> None:
    """Run the words of the shell."""
    with ending_on_signals() as imports_are_done:
        from jamlab.cli.main import app

        imports_are_done()
        app()
