"""Start the command `jamlab`."""

import signal


def main() -> None:
    """Run the words of the shell. A signal during the imports ends the process: nothing has begun."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    from jamlab.cli.main import main as run

    run()
