"""Parts of `benchmarks.pose_goals`: worlds, what can be reached in them, drives and their table."""
