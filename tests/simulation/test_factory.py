import importlib.util
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from motm_wbc.errors import InputError, Unavailable, UnknownName
from motm_wbc.scene.scenario import load_scenario
from motm_wbc.simulation import available_plants, default_plant, make_plant
from motm_wbc.simulation.quaternions import pose_matrix, quaternion


@pytest.fixture
def no_pybullet(monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *a: None if name == "pybullet" else find(name, *a)
    )


def test_the_kinematic_plant_is_always_there(no_pybullet):
    assert available_plants() == ("kinematic",)
    assert default_plant() == "kinematic"


def test_bullet_without_pybullet_says_what_is_legal(no_pybullet, model):
    with pytest.raises(Unavailable, match=r"pybullet can't be imported.*legal: kinematic"):
        make_plant("bullet", load_scenario("line"), model)


def test_an_unknown_plant_names_the_legal_ones(model):
    with pytest.raises(UnknownName, match="did you mean 'bullet'"):
        make_plant("bulet", load_scenario("line"), model)


@pytest.mark.parametrize(
    "options", [{"control_period": 0.0}, {"control_period": 2.0}, {"seed": -1}]
)
def test_options_that_make_no_sense_are_refused(model, options):
    with pytest.raises(InputError, match=next(iter(options))):
        make_plant("kinematic", load_scenario("line"), model, **options)


def test_physics_is_imported_when_it_is_used():
    code = "import sys, motm_wbc.simulation; print('pybullet' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_pybullet_prints_nothing():
    pytest.importorskip("pybullet")
    code = (
        "from motm_wbc.kinematics.loading import load_robot\n"
        "from motm_wbc.scene.scenario import load_scenario\n"
        "from motm_wbc.simulation import make_plant\n"
        "make_plant('bullet', load_scenario('line'), load_robot('frankie')).close()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


def test_closing_twice_is_harmless(kind, model):
    plant = make_plant(kind, load_scenario("line"), model)
    plant.close()
    plant.close()


@given(arrays(float, 4, elements=st.floats(-1.0, 1.0)).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternions_and_matrices_agree(q):
    q = q / np.linalg.norm(q)
    R = pose_matrix([0.0, 0.0, 0.0], q)[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    back = np.array(quaternion(R))
    assert min(np.abs(back - q).max(), np.abs(back + q).max()) < 1e-9
