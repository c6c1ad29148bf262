"""The judges of `benches/judges`, one in each file."""
