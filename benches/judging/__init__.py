"""The judges of `benches/judges`, one a file."""
