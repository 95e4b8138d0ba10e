"""Studies of real recordings: cubes, balls and pendulums that others measured. Start with `table.Study`."""
