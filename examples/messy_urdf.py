"""A file with the usual faults of a CAD export: what an audit finds, and the repaired robot in motion.

python examples/messy_urdf.py [FOLDER]
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

from roboyard import Camera, World, audit_urdf, repair_urdf
from roboyard.rendering import save_png

EXPORT = """<?xml version="1.0"?>
<robot name="crane (v2 final)">
  <link name="base"><visual><geometry><box size="0.4 0.4 0.1"/></geometry></visual></link>
  <link name="boom">
    <inertial><mass value="3"/><inertia ixx="-1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <visual><origin xyz="0.3 0 0"/><geometry><box size="0.6 0.06 0.06"/></geometry></visual>
    <collision><origin xyz="0.3 0 0"/><geometry><box size="0.6 0.06 0.06"/></geometry></collision>
  </link>
  <link name="hook">
    <inertial><mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial>
    <visual><geometry><sphere radius="0.05"/></geometry></visual>
    <collision><geometry><sphere radius="0.05"/></geometry></collision>
  </link>
  <joint name="slew" type="revolute">
    <parent link="base"/><child link="boom"/><origin xyz="0 0 0.3" rpy="0 -0.4 0"/><axis xyz="0 0 2"/>
    <limit lower="1.57" upper="-1.57" effort="0" velocity="0"/>
  </joint>
  <joint name="rope" type="prismatic">
    <parent link="boom"/><child link="hook"/><origin xyz="0.6 0 -0.05"/><axis xyz="0 0 -1"/>
    <limit lower="0" upper="0.3" effort="100" velocity="0.2"/>
  </joint>
</robot>
"""


def main(folder: Path) -> dict[str, int]:
    """Write, audit, repair and move the robot; return the number of findings by code."""
    folder.mkdir(parents=True, exist_ok=True)
    source = folder / "crane.urdf"
    source.write_text(EXPORT, encoding="utf-8")
    report = audit_urdf(source)
    for finding in report.findings:
        print(f"line {finding.line}: {finding.element}: {finding.message}\n    {finding.remedy}")
    counts = Counter(finding.code for finding in report.findings)

    repaired = repair_urdf(source, folder / "repaired")
    print(f"{len(repaired.fixes)} repairs, {len(repaired.left)} findings are left to a person")

    world = World()
    world.add_plane()
    robot = world.add_urdf(repaired.urdf, position=(0, 0, 0.05), fixed_base=True)
    robot.joint("slew").drive_position(1.0)
    robot.joint("rope").drive_position(0.2)
    world.step(480)
    save_png(folder / "crane.png", world.render(Camera.look_at(eye=(1.5, -1.2, 1.0), target=(0.2, 0.2, 0.3))))
    print("joints after two seconds:", robot.joint_positions.round(2))
    return dict(counts)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp()))
