"""Results that travel: what was found, in the words of other simulators."""
