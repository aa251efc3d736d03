"""`python -m jamlab.cli` is the command `jamlab`."""

from jamlab.cli.main import main

main()
