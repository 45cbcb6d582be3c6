"""Results as tables and JSON, for the command line."""
