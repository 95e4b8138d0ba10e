"""The air-hockey table by another engine: discs, rails and a pusher in the plane, with the physics of real ones."""
