"""The compiled forces: loading them, and the programs that say which forces act on which model."""
