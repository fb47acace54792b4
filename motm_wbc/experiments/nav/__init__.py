"""A base driven through a map, audited and recorded, without an arm."""
