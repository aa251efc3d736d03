"""Names of the public functions and classes, which the package hands down for hints.

Nothing below may import the package itself, which names all that lies above.
"""

NAMES: list[str] = []
