"""SE(2) and SE(3), arcs, polygons, primitives, base motion. Knows no robot and no scene."""
