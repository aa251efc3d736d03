"""`python -m jamlab.cli` is the command `jamlab`."""

from jamlab.cli.start import main

main()
