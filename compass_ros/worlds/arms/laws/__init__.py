"""Laws of robot joints, one kind a file; each file names its source and takes its numbers as the scale."""
