"""The suite on a robot: the only folder that knows ROS. A node declares, subscribes, converts, calls, publishes."""
