"""One run of a scenario, and what is measured of it."""
