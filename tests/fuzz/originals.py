"""Good inputs of every kind, small enough to be spoiled a hundred thousand times."""

from typing import Any

URDF = """<?xml version="1.0"?>
<robot name="pincer">
  <link name="palm"><collision><geometry><box size="0.06 0.08 0.02"/></geometry></collision></link>
  <link name="index_proximal"><inertial><mass value="0.02"/>
    <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.02 0 0" rpy="0 1.5708 0"/><geometry><cylinder radius="0.008" length="0.03"/>
    </geometry></collision></link>
  <link name="index_distal"><collision><origin xyz="0.015 0 0"/><geometry>
    <mesh filename="link.stl" scale="1 1 1"/></geometry></collision></link>
  <link name="thumb"><collision><origin xyz="0.02 0 0"/><geometry><sphere radius="0.01"/></geometry>
    </collision></link>
  <joint name="index_a" type="revolute"><parent link="palm"/><child link="index_proximal"/>
    <origin xyz="0.03 0.02 0.01" rpy="0 0 0"/>
    <axis xyz="0 -1 0"/><limit lower="0" upper="1.6" effort="1" velocity="3"/></joint>
  <joint name="index_b" type="revolute"><parent link="index_proximal"/><child link="index_distal"/>
    <origin xyz="0.04 0 0"/>
    <axis xyz="0 -1 0"/><limit lower="0" upper="1.4" effort="1" velocity="3"/>
    <mimic joint="index_a" multiplier="0.8" offset="0"/></joint>
  <joint name="thumb_a" type="revolute"><parent link="palm"/><child link="thumb"/>
    <origin xyz="-0.03 0 0.01" rpy="0 0 3.14159"/>
    <axis xyz="0 -1 0"/><limit lower="-0.2" upper="1.5" effort="1" velocity="3"/></joint>
</robot>
"""

MJCF = """<mujoco model="pincer">
  <compiler angle="radian" autolimits="true"/>
  <asset><mesh name="tip" file="link.stl"/></asset>
  <default><joint range="0 1.6" damping="0.1"/><geom contype="1" conaffinity="1"/></default>
  <worldbody>
    <body name="palm" pos="0 0 0"><geom type="box" size="0.03 0.04 0.01"/>
      <body name="index_1" pos="0.03 0.02 0.01"><joint name="index_1" axis="0 -1 0"/>
    <geom type="capsule" fromto="0 0 0 0.04 0 0" size="0.008"/>
        <body name="index_2" pos="0.04 0 0"><joint name="index_2" axis="0 -1 0" range="0 1.4"/>
    <geom type="mesh" mesh="tip"/></body></body>
      <body name="thumb_1" pos="-0.03 0 0.01" euler="0 0 3.14159"><joint name="thumb_1" axis="0 -1 0"/>
    <geom type="ellipsoid" size="0.03 0.01 0.01" pos="0.02 0 0"/></body>
    </body>
  </worldbody>
  <tendon><fixed name="t"><joint joint="thumb_1" coef="1"/></fixed></tendon>
  <equality><joint joint1="index_2" joint2="index_1" polycoef="0 0.8 0 0 0"/></equality>
  <contact><exclude body1="palm" body2="index_2"/></contact>
  <actuator><position joint="index_1" kp="3" ctrlrange="0 1.6" forcerange="-1 1"/><position tendon="t" kp="3"/>
    </actuator>
</mujoco>
"""

HAND_FILE = """palm = "palm"
collision_source = "engine"
allowed_pairs = [["palm", "index_distal"]]

[fingers.index]
joints = ["index_a", "index_b"]
tip = "index_distal"
thumb = false

[joints.index_a]
role = "closing"
direction = 1
open = 0.1

[joints.index_b]
follows = "index_a"
ratio = 0.7
offset = 0.0
breakaway = false

[links.index_distal]
pad_indentation = 0.001
friction = 0.8

[tendons]
joints = ["index_a"]
moment_arms = [[0.008, -0.008]]
t_min = 0.0
t_max = 200.0
"""

CALIBRATION = """[weights]
range_of_motion = 1.0
touching_links = 2.0
"""

COMMAND: dict[str, Any] = {
    "hand_pose": {"position": [0.0, 0.0, -0.05], "wxyz": [1.0, 0.0, 0.0, 0.0]},
    "root_link": "palm",
    "object_pose": {"position": [0.01, 0.0, 0.03], "wxyz": [1.0, 0.0, 0.0, 0.0]},
    "preshape": {"index_a": 0.1},
    "fingers": ["index", "thumb"],
    "order": "proximal-first",
    "rounds": 1,
    "planes": 2,
    "full_width": True,
    "yaw_grid": [0.0],
    "open_variants": [0.0, 0.1],
    "check_candidates": False,
    "measure": True,
    "collision_source": "engine",
    "criteria": {"range_of_motion": 1.0},
    "seed": 3,
}

SHAPES = (
    "sphere:r=0.02",
    "cylinder:r=0.02,h=0.05",
    "capsule:r=0.01,h=0.05",
    "box:x=0.03,y=0.03,z=0.05",
    "ellipsoid:a=0.02,b=0.03,c=0.01",
)


def link_stl() -> bytes:
    """Return a small link as a binary STL file."""
    import trimesh

    return bytes(trimesh.creation.box((0.03, 0.012, 0.01)).export(file_type="stl"))


def mesh_files() -> dict[str, bytes]:
    """Return a ball in every format that objects are read from, by suffix."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.02)
    files = {}
    for suffix in ("obj", "stl", "ply", "off", "glb", "stl_ascii"):
        data = ball.export(file_type=suffix)
        files[suffix] = data.encode() if isinstance(data, str) else bytes(data)
    ascii_ply = trimesh.exchange.ply.export_ply(ball, encoding="ascii")
    files["ply_ascii"] = ascii_ply.encode() if isinstance(ascii_ply, str) else ascii_ply
    return files
