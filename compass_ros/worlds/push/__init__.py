"""A slender bar on four feet that a tool pushes over a table: friction of real surfaces."""
