"""The explorer: a sweep as one interactive page, drawn in the browser from arrays that jamlab has computed."""
