"""The proof: many sealed worlds, each calibrated blindly, unsealed and counted."""
