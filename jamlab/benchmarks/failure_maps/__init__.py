"""Where methods converge, stall or are refused, one map a file."""
