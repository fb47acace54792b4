"""extremitypathfinder's answers, in an environment of its own: JSON on stdin, JSON on stdout.

In: a list of maps, {"boundary": [[x, y], ..], "holes": [..], "queries": [[start, goal], ..]}.
Out: for each map, the lengths of the paths [m], null where there is none.
"""

import json
import sys

from extremitypathfinder import PolygonEnvironment

answers = []
for drawn in json.load(sys.stdin):
    environment = PolygonEnvironment()
    environment.store(drawn["boundary"], drawn["holes"])
    lengths = [
        environment.find_shortest_path(tuple(start), tuple(goal))[1]
        for start, goal in drawn["queries"]
    ]
    answers.append(lengths)
json.dump(answers, sys.stdout)
