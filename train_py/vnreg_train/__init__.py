"""Training, evaluation and export of the vnreg networks (torch; not needed at run time)."""
