"""The planner against a full visibility graph in exact rational arithmetic.

The reference knows neither tangents nor unions: nodes are all corners and all crossings of
edges, every free segment between two nodes is an edge, the search runs over directed edges
in both gears. Around every point the plane falls into free sectors; a path may pass a point
only within one sector, so that nothing slips between obstacles that touch.
"""

import heapq
import itertools
import math
from fractions import Fraction

import numpy as np
import pytest

from motm_wbc.basenav.goal_field import cost_to_go
from motm_wbc.basenav.planner import GlobalPlanner
from motm_wbc.basenav.world import World
from motm_wbc.errors import NoPath

# --- exact geometry of points ((x, y) of Fractions) and rings (blocked on the left) ---


def cross(u, v):
    return u[0] * v[1] - u[1] * v[0]


def dot(u, v):
    return u[0] * v[0] + u[1] * v[1]


def sub(p, q):
    return (p[0] - q[0], p[1] - q[1])


def on_segment(x, a, b):
    return (
        cross(sub(b, a), sub(x, a)) == 0
        and min(a[0], b[0]) <= x[0] <= max(a[0], b[0])
        and min(a[1], b[1]) <= x[1] <= max(a[1], b[1])
    )


def edges_of(ring):
    return list(zip(ring, ring[1:] + ring[:1], strict=True))


def half(u):
    return 0 if (u[1] > 0 or (u[1] == 0 and u[0] > 0)) else 1


def ccw_key_less(u, v):
    return half(u) < half(v) or (half(u) == half(v) and cross(u, v) > 0)


class Ring:
    """A ring with the blocked region on its left; `outer` for the boundary."""

    def __init__(self, points, outer=False):
        area = sum(cross(a, b) for a, b in edges_of(points))
        if (area > 0) == outer:
            points = points[::-1]
        self.points, self.outer = points, outer
        self.edges = edges_of(points)

    def blocks_inside(self, x):
        """Strictly inside of what is blocked; x is on no edge."""
        inside = False
        for a, b in self.edges:
            if (a[1] > x[1]) != (b[1] > x[1]):
                at = a[0] + (x[1] - a[1]) * (b[0] - a[0]) / (b[1] - a[1])
                if x[0] < at:
                    inside = not inside
        return inside != self.outer

    def cones(self, x):
        """Blocked cones at x as (from, to) counter-clockwise; None: not on the ring."""
        found = None
        count = len(self.points)
        for i, p in enumerate(self.points):
            if p == x:
                after, before = self.points[(i + 1) % count], self.points[i - 1]
                found = [*(found or []), (sub(after, x), sub(before, x))]
        if found is None:
            for a, b in self.edges:
                if on_segment(x, a, b):
                    found = [(sub(b, x), sub(a, x))]
        return found


def in_open_cone(w, cone):
    start, end = cone
    if cross(start, end) > 0:
        return cross(start, w) > 0 and cross(w, end) > 0
    if cross(start, end) == 0:  # straight
        return cross(start, w) > 0
    return not (cross(end, w) >= 0 and cross(w, start) >= 0)


class Map:
    def __init__(self, obstacles, boundary=None):
        self.rings = [Ring(points) for points in obstacles]
        if boundary is not None:
            self.rings.append(Ring(boundary, outer=True))
        self.edges = [edge for ring in self.rings for edge in ring.edges]
        self.boxes = [
            tuple(float(f(a[k], b[k])) for k in (0, 1) for f in (min, max)) for a, b in self.edges
        ]
        self.sectors_at = {}

    def nodes(self):
        found = {p for ring in self.rings for p in ring.points}
        for (a, b), (c, d) in itertools.combinations(self.edges, 2):
            u, v = sub(b, a), sub(d, c)
            slope = cross(u, v)
            if slope != 0:
                t, s = cross(sub(c, a), v) / slope, cross(sub(c, a), u) / slope
                if 0 <= t <= 1 and 0 <= s <= 1:
                    found.add((a[0] + t * u[0], a[1] + t * u[1]))
        return [x for x in sorted(found) if not self.is_blocked(x)]

    def is_blocked(self, x):
        return not any(self.sectors(x))

    def sectors(self, x):
        """Free sectors at x as (from, to); [None] is all directions, [] none."""
        if x in self.sectors_at:
            return self.sectors_at[x]
        cones = []
        for ring in self.rings:
            here = ring.cones(x)
            if here is not None:
                cones += here
            elif ring.blocks_inside(x):
                self.sectors_at[x] = []
                return []
        if not cones:
            free = [(None, None)]
        else:
            rays = []
            for ray in itertools.chain(*cones):
                if not any(cross(ray, r) == 0 and dot(ray, r) > 0 for r in rays):
                    at = sum(ccw_key_less(r, ray) for r in rays)
                    rays.insert(at, ray)
            free = []
            for ray, after in zip(rays, rays[1:] + rays[:1], strict=True):
                middle = self._between(ray, after)
                if not any(in_open_cone(middle, cone) for cone in cones):
                    free.append((ray, after))
        self.sectors_at[x] = free
        return free

    @staticmethod
    def _between(u, v):
        turn = cross(u, v)
        if turn == 0:
            return (-u[1], u[0])
        scale = Fraction(abs(u[0]) + abs(u[1])) / (abs(v[0]) + abs(v[1]))
        middle = (u[0] + v[0] * scale, u[1] + v[1] * scale)
        return middle if turn > 0 else (-middle[0], -middle[1])

    def sector(self, x, w):
        """The free sector whose closure has the ray w from x, or None."""
        for number, (start, end) in enumerate(self.sectors(x)):
            if start is None or not in_open_cone(w, (end, start)):
                if start is not None and cross(start, end) == 0 and cross(start, w) < 0:
                    continue
                return number
        return None

    def free_segment(self, p, q):
        d = sub(q, p)
        if self.sector(p, d) is None or self.sector(q, (-d[0], -d[1])) is None:
            return False
        low_x, high_x = sorted((float(p[0]), float(q[0])))
        low_y, high_y = sorted((float(p[1]), float(q[1])))
        square = dot(d, d)
        stops = set()
        for (a, b), (x0, x1, y0, y1) in zip(self.edges, self.boxes, strict=True):
            if x0 > high_x or x1 < low_x or y0 > high_y or y1 < low_y:
                continue
            s_a, s_b = cross(d, sub(a, p)), cross(d, sub(b, p))
            if (s_a > 0 and s_b > 0) or (s_a < 0 and s_b < 0):
                continue
            if s_a == s_b == 0:
                stops |= {dot(d, sub(a, p)) / square, dot(d, sub(b, p)) / square}
            else:
                u = sub(b, a)
                stops.add(cross(sub(a, p), u) / cross(d, u))
        for t in stops:
            if 0 < t < 1:
                x = (p[0] + t * d[0], p[1] + t * d[1])
                here = self.sector(x, d)
                if here is None or here != self.sector(x, (-d[0], -d[1])):
                    return False
        return True


class Reference:
    """Full visibility graph of a map, with what belongs to no start or goal kept."""

    def __init__(self, obstacles, boundary=None):
        self.map = Map(obstacles, boundary)
        self.corners = self.map.nodes()
        self.visible = {}

    def sees(self, p, q):
        if (p, q) not in self.visible:
            self.visible[p, q] = self.visible[q, p] = self.map.free_segment(p, q)
        return self.visible[p, q]

    def time(self, start, goal, v, v_reverse, omega):
        times = [self._gear(start, goal, v, omega, 0.0)]
        if v_reverse > 0.0:
            times.append(self._gear(start, goal, v_reverse, omega, math.pi))
        return min(times)

    def _gear(self, start, goal, speed, omega, flip):
        (p, heading), (q, goal_heading) = start, goal
        if p == q:
            return bend(heading, goal_heading) / omega
        nodes = [*(x for x in self.corners if x not in (p, q)), p, q]
        begin, end = len(nodes) - 2, len(nodes) - 1
        leaving = {i: [] for i in range(len(nodes))}
        for i, j in itertools.permutations(range(len(nodes)), 2):
            if i != end and j != begin and self.sees(nodes[i], nodes[j]):
                d = sub(nodes[j], nodes[i])
                angle = math.atan2(d[1], d[0])
                length = math.hypot(d[0], d[1])
                out = self.map.sector(nodes[i], d)
                arrival = self.map.sector(nodes[j], (-d[0], -d[1]))
                leaving[i].append((j, angle, length, out, arrival))
        queue = []
        best = {}
        for j, angle, length, _, arrival in leaving[begin]:
            turned = bend(None if heading is None else heading + flip, angle)
            heapq.heappush(queue, (turned / omega + length / speed, begin, j, angle, arrival))
        answer = math.inf
        while queue:
            cost, i, j, angle, sector = heapq.heappop(queue)
            if cost >= answer:
                break
            if (i, j) in best:
                continue
            best[i, j] = cost
            if j == end:
                last = bend(angle, None if goal_heading is None else goal_heading + flip)
                answer = min(answer, cost + last / omega)
                continue
            for k, onward, length, out, arrival in leaving[j]:
                if out == sector and (j, k) not in best:
                    step = bend(angle, onward) / omega + length / speed
                    heapq.heappush(queue, (cost + step, j, k, onward, arrival))
        return answer


def bend(first, second):
    if first is None or second is None:
        return 0.0
    return abs(math.remainder(second - first, math.tau))


# --- random maps ---


def box(x, y, w, h):
    return [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]


def integer_obstacle(rng):
    x, y = rng.integers(0, 7, 2)
    kind = rng.integers(0, 5)
    w, h = rng.integers(1, 4, 2)
    if kind <= 1:
        return box(x, y, w, h)
    if kind == 2:  # an L, concave
        return [(x, y), (x + 3, y), (x + 3, y + 1), (x + 1, y + 1), (x + 1, y + 3), (x, y + 3)]
    if kind == 3:  # a diamond: touches boxes at its corners
        return [(x + 1, y), (x + 2, y + 1), (x + 1, y + 2), (x, y + 1)]
    return [(x, y), (x + w + 1, y + 1), (x + 1, y + h + 1)]


def float_obstacle(rng):
    angles = np.sort(rng.uniform(0.0, math.tau, rng.integers(3, 7)))
    radius = rng.uniform(0.4, 2.0, angles.size)  # star-shaped: often concave
    centre = rng.uniform(1.0, 7.0, 2)
    points = centre + radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    gaps = np.diff(np.append(angles, angles[0] + math.tau))
    return points.tolist() if gaps.max() < 3.0 else float_obstacle(rng)


def exact(points):
    return [(Fraction(float(x)), Fraction(float(y))) for x, y in points]


def make_map(seed):
    """Obstacles and boundary of a random small map: of six sorts, by the seed."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 5))
    sort = seed % 6
    if sort <= 2:
        obstacles = [integer_obstacle(rng) for _ in range(count)]
    elif sort == 3:
        obstacles = [float_obstacle(rng) for _ in range(min(count, 3))]
    elif sort == 4:  # symmetric: a row of boxes, some of which touch
        x = np.cumsum([0, *rng.integers(1, 3, 2)])
        obstacles = [box(int(k), 3, 1, 2) for k in x]
    else:  # a courtyard with a gate or none
        gate = int(rng.integers(0, 2))
        obstacles = [box(1, 1, 6, 1), box(1, 6, 6, 1), box(1, 1, 1, 6), box(6, 1, 1, 6 - gate)]
        obstacles = [*obstacles[: 3 + int(rng.integers(0, 2))], integer_obstacle(rng)]
    boundary = box(-1, -1, 10, 10) if seed % 4 == 0 else None
    return rng, obstacles, boundary


def random_pose(rng, lattice):
    x, y = rng.integers(0, 9, 2) if lattice else rng.uniform(-0.9, 8.9, 2)
    heading = None if rng.random() < 0.15 else float(rng.uniform(-math.pi, math.pi))
    return float(x), float(y), heading


def queries(rng, reference, seed, count=4):
    """Pairs of free poses; in lattice maps often on edges and corners."""
    poses = []
    while len(poses) < 2 * count:
        pose = random_pose(rng, lattice=seed % 6 != 3 and rng.random() < 0.5)
        if not reference.map.is_blocked(exact([pose[:2]])[0]):
            poses.append(pose)
    return list(zip(poses[::2], poses[1::2], strict=True))


@pytest.mark.parametrize("seed", range(72))
def test_times_equal_the_full_visibility_graphs(seed):
    rng, obstacles, boundary = make_map(seed)
    omega = float(rng.choice([0.5, 1.745, 1e9]))
    v, v_reverse = 0.5, float(rng.choice([0.0, 0.2, 0.5]))
    reference = Reference(
        [exact(points) for points in obstacles], None if boundary is None else exact(boundary)
    )
    world = World(
        [np.array(points, dtype=float) for points in obstacles],
        None if boundary is None else np.array(boundary, dtype=float),
    )
    planner = GlobalPlanner(world, v, omega, v_reverse=v_reverse)
    for start, goal in queries(rng, reference, seed):
        place, target = exact([start[:2], goal[:2]])
        expected = reference.time((place, start[2]), (target, goal[2]), v, v_reverse, omega)
        heading = math.nan if start[2] is None else start[2]
        found = cost_to_go(planner.goal_field(goal), start[0], start[1], heading)
        assert found == pytest.approx(expected, abs=1e-9), (start, goal)
        if math.isinf(expected):
            with pytest.raises(NoPath):
                planner.plan(start, goal)
        else:
            assert planner.plan(start, goal).time == pytest.approx(expected, abs=1e-9)
