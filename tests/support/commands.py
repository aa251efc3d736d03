"""Run commands of `jamlab` in this process: a fresh Python for each costs a second."""

import contextlib

from typer.testing import CliRunner

from jamlab.cli.main import app


def call(folder, *words):
    """Run a command in a folder; the result has exit_code, stdout and stderr."""
    with contextlib.chdir(folder):
        done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    assert "a fault of jamlab" not in done.stderr, done.stderr
    return done
