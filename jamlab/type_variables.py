"""Type variables of functions that take or return another one's type: one place, which imports nothing else."""

from typing import ParamSpec, TypeVar

P = ParamSpec("P")  # arguments of a function that is wrapped
R = TypeVar("R")  # what it returns
T = TypeVar("T")  # any type that is handed through
