"""The world as data: solids, supports, objects, the task; its footprints; its files."""
