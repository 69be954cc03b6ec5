"""Sound assets to spoil, and how they are read."""

from pathlib import Path

from tendon_newton.mechanisms.asset_library import asset_path
from tendon_newton.mechanisms.authoring.foreign_file import read_foreign
from tendon_newton.mechanisms.authoring.foreign_plan import plan_foreign, write_foreign
from tendon_newton.mechanisms.checks import check_asset
from tendon_newton.mechanisms.loading import load_mechanism
from tendon_newton.mechanisms.usd.stage_file import open_stage
from tests.mechanisms.broken.flat_assets import flat_text

URDF = """<robot name="finger">
 <link name="base"/>
 <material name="grey"><color rgba="0.5 0.5 0.5 1"/><texture filename="grey.png"/></material>
 <link name="proximal">
  <visual><geometry><mesh filename="package://hand/meshes/link.stl" scale="1 1 1"/></geometry>
   <material name="grey"/></visual>
  <collision><geometry><cylinder radius="0.01" length="0.04"/></geometry></collision>
  <inertial><mass value="0.012"/><origin xyz="0.02 0 0"/>
  <inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="knuckle" type="revolute"><parent link="base"/><child link="proximal"/>
  <axis xyz="0 1 0"/><limit lower="0" upper="1.7" effort="1" velocity="9"/></joint>
 <link name="pad"><inertial><mass value="0.001"/><inertia ixx="1e-8" iyy="1e-8" izz="1e-8"
  ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="glue" type="fixed"><parent link="proximal"/><child link="pad"/>
  <origin xyz="0.04 0 0" rpy="0 0.1 0"/></joint>
</robot>
"""
MJCF = """<mujoco model="finger">
 <include file="inner.xml"/>
 <compiler meshdir="meshes"/>
 <default><default class="seen"><geom type="mesh" contype="0" conaffinity="0"/></default></default>
 <asset><mesh name="link" file="link.stl"/><texture name="t" type="2d" file="t.png"/></asset>
 <worldbody><body name="proximal" pos="0 0 0.1"><joint name="knuckle" axis="0 1 0" range="0 97"/>
  <geom type="capsule" size="0.006 0.02" mass="0.012"/>
  <geom class="seen" mesh="link"/><inertial pos="0.02 0 0"
   mass="0.012" diaginertia="1e-6 1e-6 1e-6"/>
  <site name="tip" pos="0.04 0 0"/>
 </body></worldbody>
</mujoco>
"""


def text_asset(folder: Path) -> Path:
    """Write the finger as one text."""
    (folder / "finger.usda").write_text(flat_text("finger"))
    return folder / "finger.usda"


def binary_asset(folder: Path) -> Path:
    """Write the finger in USD's binary form."""
    open_stage(asset_path("finger")).Flatten().Export(str(folder / "finger.usdc"))
    return folder / "finger.usdc"


def read_asset(path: Path) -> None:
    """Check an asset, and load it if nothing is wrong."""
    if not any(finding.severity == "error" for finding in check_asset(path)):
        load_mechanism(path)


def mjcf_file(folder: Path) -> Path:
    """Write a finger of MuJoCo."""
    (folder / "inner.xml").write_text("<mujocoinclude/>")
    (folder / "finger.xml").write_text(MJCF)
    return folder / "finger.xml"


def urdf_file(folder: Path) -> Path:
    """Write a finger of ROS."""
    (folder / "finger.urdf").write_text(URDF)
    return folder / "finger.urdf"


def read_import(path: Path) -> None:
    """Import as an arm, with a tip in the last link, and load what was written."""
    finger = read_foreign(path)
    plan = plan_foreign("mine", finger, tip=(0.04, 0.0, 0.0), spool_radius=0.01, force_limit=3.0)
    load_mechanism(write_foreign(path.parent / "made", plan))
