"""What methods cost, where they break, and what other codes give."""
