"""`make bench`: what the engine takes, beside its peers and beside what the processor can do."""
