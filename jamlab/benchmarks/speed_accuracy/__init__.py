"""Cost against error of every method, one topic a file."""
