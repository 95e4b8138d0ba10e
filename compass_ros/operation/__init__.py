"""What a working day in a cell needs, without ROS: versions of the parameters, the running check, the mismatch map."""
