"""What fixed work costs at a commit, and which work has become slower."""
