"""Settings of all tests, and a maker of other robots than the shipped ones."""

import os

import pytest
from hypothesis import settings

# The same examples on every machine, however busy; HYPOTHESIS_PROFILE=explore draws new ones.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("explore", derandomize=False, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fixed"))

_REST_OF_ROBOT = """
license = "Apache-2.0"
source = "this test"
[base]
kind = "omnidirectional"
outline = [[-0.2, -0.15], [0.2, -0.15], [0.3, 0.0], [0.2, 0.15], [-0.2, 0.15]]
height = 0.3
mass = 30.0
v_max = 0.6
v_reverse = 0.6
omega_max = 1.5
a_max = 0.8
alpha_max = 2.0
[gripper]
max_width = 0.1
closing_speed = 0.1
opening_speed = 0.1
force = 10.0
[reach]
grasp_range = 0.5
hold_radius = 0.4
bearing_limit = 3.0
"""


@pytest.fixture(scope="session")
def write_robot():
    """Writes a robot: what is its own comes from the test, base, gripper and reach from here."""

    def write(folder, name, urdf, head, tables):
        (folder / f"{name}.urdf").write_text(urdf)
        own = f'name = "{name}"\n{head}'
        arm = f'[arm]\nurdf = "{name}.urdf"\n'
        (folder / "robot.toml").write_text(own + _REST_OF_ROBOT + arm + tables)

    return write
