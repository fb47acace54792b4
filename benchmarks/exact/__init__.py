"""Brute-force references for the global planner, and random maps to compare on."""
