"""Twenty episodes with an arm at a table and five objects, each from resetSimulation on, 50 steps each."""

import pybullet_data

import pybullet as p

OBJECTS = ("cube_small.urdf", "sphere_small.urdf", "cube_small.urdf", "duck_vhacd.urdf", "lego/lego.urdf")

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
for _ in range(20):
    p.resetSimulation()
    p.setGravity(0, 0, -9.81)
    p.loadURDF("plane.urdf", [0, 0, -0.65])
    p.loadURDF("table/table.urdf", [0.5, 0, -0.65])
    arm = p.loadURDF("kuka_iiwa/model.urdf", useFixedBase=True)
    for joint in range(7):
        p.resetJointState(arm, joint, 0.1 * joint)
    reach = p.getLinkState(arm, 6)[0]
    objects = [p.loadURDF(file, [0.4 + 0.05 * k, 0.1 * k - 0.2, 0.1]) for k, file in enumerate(OBJECTS)]
    for _step in range(50):
        for joint in range(7):
            p.setJointMotorControl2(arm, joint, p.POSITION_CONTROL, 0.1 * joint, force=200)
        p.stepSimulation()
    heights = [p.getBasePositionAndOrientation(body)[0][2] for body in objects]
print(reach, heights)
