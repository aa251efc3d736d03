"""Charts of cost against error, one method after another."""
