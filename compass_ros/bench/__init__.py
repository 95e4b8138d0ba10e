"""The benchmark: tasks x methods x seeds, resumable, with tables and figures drawn from its results."""
