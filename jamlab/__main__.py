"""`python -m jamlab` is the command `jamlab`."""

from jamlab.cli.start import main

main()
