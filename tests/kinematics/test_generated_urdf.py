from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from motm_wbc.kinematics import load_robot
from motm_wbc.kinematics.urdf import BASE_JOINTS, build_urdf


def load_in_pybullet(bullet, model):
    body = bullet.loadURDF(str(model.urdf_path), useFixedBase=True)
    infos = [bullet.getJointInfo(body, i) for i in range(bullet.getNumJoints(body))]
    joints = {info[1].decode(): info[0] for info in infos}
    links = {info[12].decode(): info[0] for info in infos}
    return body, joints, links


@pytest.fixture
def bullet():
    pybullet = pytest.importorskip("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    yield pybullet
    pybullet.disconnect(client)


def test_pybullet_agrees_on_every_link(bullet, robot):
    body, joints, links = load_in_pybullet(bullet, robot)
    rng = np.random.default_rng(6)
    low = np.where(np.isfinite(robot.q_lower), robot.q_lower, -3.0)
    high = np.where(np.isfinite(robot.q_upper), robot.q_upper, 3.0)
    width_max = robot.description.gripper.max_width
    worst = 0.0
    for _ in range(200):
        base_pose, q = rng.uniform(-2.0, 2.0, 3), rng.uniform(low, high)
        width = rng.uniform(0.0, width_max)
        here = robot.configuration(base_pose, q, width)
        names = (*BASE_JOINTS, *robot.arm_joints, *robot.finger_joints)
        values = (*base_pose, *q, *robot.finger_positions(width))
        for name, value in zip(names, values, strict=True):
            bullet.resetJointState(body, joints[name], value)
        for name, index in links.items():
            state = bullet.getLinkState(body, index, computeForwardKinematics=True)
            rotation = np.array(bullet.getMatrixFromQuaternion(state[5])).reshape(3, 3)
            T = here.link_pose(name)
            worst = max(worst, np.abs(np.array(state[4]) - T[:3, 3]).max())
            worst = max(worst, np.abs(rotation - T[:3, :3]).max())
    assert len(links) >= 9
    assert worst < 1e-6


def test_pybullet_reads_masses_and_shapes(bullet, frankie):
    body, _, links = load_in_pybullet(bullet, frankie)
    masses = {name: bullet.getDynamicsInfo(body, i)[0] for name, i in links.items()}
    assert masses["base_link"] == 62.0
    assert masses["panda_link1"] == pytest.approx(4.970684)
    assert all(0.0 < mass < 70.0 for mass in masses.values())
    shapes = {name: len(bullet.getCollisionShapeData(body, i)) for name, i in links.items()}
    assert shapes["base_link"] == shapes["panda_hand"] == 1
    assert shapes["panda_leftfinger"] == 4
    low, high = bullet.getAABB(body, links["base_link"])
    np.testing.assert_allclose(np.array(high) - low, [0.68, 0.47, 0.38], atol=0.03)


def test_rerun_draws_every_mesh(frankie, tmp_path):
    rerun = pytest.importorskip("rerun")
    from rerun.chunk import RrdReader

    recording = rerun.RecordingStream("urdf")
    recording.save(tmp_path / "robot.rrd")
    rerun.urdf.UrdfTree.from_file_path(frankie.urdf_path).log_urdf_to_recording(recording)
    recording.disconnect()
    paths = {str(chunk.entity_path) for chunk in RrdReader(tmp_path / "robot.rrd").stream()}
    drawn = {path.split("/")[3] for path in paths if path.startswith("/frankie/visual_geometries")}
    assert drawn == {
        "base_link",
        "panda_hand",
        "panda_leftfinger",
        "panda_rightfinger",
        *(f"panda_link{i}" for i in range(8)),
    }


def test_every_link_has_mass_and_every_mesh_a_place(robot):
    tree = ElementTree.parse(robot.urdf_path).getroot()
    links = tree.findall("link")
    assert len(links) >= 9
    for link in links:
        mass = link.find("inertial/mass")
        assert mass is not None and float(mass.get("value", "0")) > 0.0, link.get("name")
    for mesh in tree.iterfind(".//mesh"):
        path = Path(mesh.get("filename", ""))
        assert path.is_absolute() and path.is_file()
    assert tree.find(".//mimic") is None


def test_same_robot_same_file(frankie):
    again = load_robot("frankie")
    assert again.urdf_path == frankie.urdf_path
    folder = Path(__file__).parent
    assert build_urdf(frankie.description, folder, "x") == frankie.urdf_path.read_text()


def test_locked_joint_keeps_its_position(mini):
    tree = ElementTree.parse(mini.urdf_path).getroot()
    joint = next(j for j in tree.iterfind("joint") if j.get("name") == "a_stiff")
    assert joint.get("type") == "fixed"
    here = mini.configuration(np.zeros(3), mini.home)
    R = here.link_pose("a_upper")[:3, :3].T @ here.link_pose("a_bracket")[:3, :3]
    angle = 0.1 + 0.6  # both about y
    np.testing.assert_allclose(
        R,
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]],
        atol=1e-12,
    )


def test_links_above_the_mount_are_left_out(mini):
    names = {link.get("name") for link in ElementTree.parse(mini.urdf_path).iterfind("link")}
    assert "a_world" not in names
    assert {"world", "base_link", "a_foot", "a_wrist", "tool"} <= names


def test_prism_base_is_the_footprint(mini):
    tree = ElementTree.parse(mini.urdf_path).getroot()
    base = next(link for link in tree.iterfind("link") if link.get("name") == "base_link")
    mesh_element = base.find("collision/geometry/mesh")
    mesh = trimesh.load_mesh(mesh_element.get("filename"))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(0.3 * (0.4 * 0.3 + 0.5 * 0.3 * 0.1))
    np.testing.assert_allclose(mesh.bounds, [[-0.2, -0.15, 0.0], [0.3, 0.15, 0.3]])
    assert mini.footprint.shape == (5, 2)
    np.testing.assert_allclose(mini.base_box.size, [0.5, 0.3, 0.3])
    np.testing.assert_allclose(mini.base_box.centre, [0.05, 0.0, 0.15])
