"""A force law, a drag law, a model and an observable for jamlab, from another package."""
