"""A rope of forty links on spherical joints swings against a box, three simulated seconds."""

import pybullet_data

import pybullet as p

COUNT = 40

p.connect(p.DIRECT)
p.setAdditionalSearchPath(pybullet_data.getDataPath())
p.setGravity(0, 0, -9.81)
p.loadURDF("plane.urdf")
box = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.2, 0.2, 0.4])
p.createMultiBody(0, box, -1, [0.8, 0, 0.4])
ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.02)
rope = p.createMultiBody(
    0.1, ball, -1, [0, 0, 1.5],
    linkMasses=[0.05] * COUNT,
    linkCollisionShapeIndices=[ball] * COUNT,
    linkVisualShapeIndices=[-1] * COUNT,
    linkPositions=[[0.05, 0, 0]] * COUNT,
    linkOrientations=[[0, 0, 0, 1]] * COUNT,
    linkInertialFramePositions=[[0, 0, 0]] * COUNT,
    linkInertialFrameOrientations=[[0, 0, 0, 1]] * COUNT,
    linkParentIndices=list(range(COUNT)),
    linkJointTypes=[p.JOINT_SPHERICAL] * COUNT,
    linkJointAxis=[[0, 0, 1]] * COUNT,
)  # fmt: skip
for joint in range(COUNT):
    p.setJointMotorControlMultiDof(
        rope, joint, p.POSITION_CONTROL, [0, 0, 0, 1], positionGain=0, velocityGain=1, force=[0.001] * 3
    )
p.createConstraint(rope, -1, -1, -1, p.JOINT_POINT2POINT, [0, 0, 0], [0, 0, 0], [0, 0, 1.5])
for _ in range(720):
    p.stepSimulation()
print([round(x, 2) for x in p.getLinkState(rope, COUNT - 1)[0]])
