"""Subcommands of `compass`, one file each; each adds itself to the application."""
