"""Classes of results and of settings; functions of `jamlab` make and take them, and few scripts name them."""

from jamlab.engine.session import Evaluation as Evaluation
