"""Run commands of `jamlab` and of the studies in this process: a fresh Python for each costs a second."""

import contextlib
from functools import cache

from typer import testing
from typer.main import get_command

from jamlab.cli.main import app

testing._get_command = cache(get_command)  # else options of all commands are read from their functions at every call


def call(folder, *words, app=app):
    """Run a command in a folder; the result has exit_code, stdout and stderr."""
    with contextlib.chdir(folder):
        done = testing.CliRunner().invoke(app, [str(word) for word in words])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    assert "a fault of jamlab" not in done.stderr, done.stderr
    return done


def call_studies(folder, *words):
    """Run a command of `python -m studies` likewise."""
    from studies.commands import app

    return call(folder, *words, app=app)
