"""Speed of one control step, beside other libraries on the same recorded states."""
