"""The main job on one machine: node processes over DDS, from a shot to a calibrated parameter."""
