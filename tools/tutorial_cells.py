"""The well-known PyBullet tutorial, cell by cell, on Roboyard and its own robots.

`tools/make_notebook.py` makes examples/pybullet_tutorial.ipynb of these cells. They need no display, and the
sixth writes husky_falling.gif.
"""

# ruff: noqa: E402

# %% 1. Server-client connection

import roboyard.pybullet as p

# p.connect(p.GUI)
print(p.connect(p.DIRECT))

# %% 2. How to load bodies

import roboyard.pybullet_data as pybullet_data

p.setAdditionalSearchPath(pybullet_data.getDataPath())

# First, let's make sure we start with a fresh new simulation.
p.resetSimulation()

# Load our simulation floor plane at the origin (0, 0, 0).
terrain = p.loadURDF("plane.urdf")

# Load an R2D2 droid at the position at 0.5 meters height in the z-axis.
r2d2 = p.loadURDF("r2d2.urdf", [0, 0, 0.5])

# We can check the number of bodies we have in the simulation.
print(p.getNumBodies())

# %% 3. How to get input data

from PIL import Image


def show_render(p):
    width = 320
    height = 200
    img_arr = p.getCameraImage(
        width,
        height,
        viewMatrix=p.computeViewMatrixFromYawPitchRoll(
            cameraTargetPosition=[0, 0, 0],
            distance=4,
            yaw=60,
            pitch=-10,
            roll=0,
            upAxisIndex=2,
        ),
        projectionMatrix=p.computeProjectionMatrixFOV(
            fov=60,
            aspect=width / height,
            nearVal=0.01,
            farVal=100,
        ),
        shadow=True,
        lightDirection=[1, 1, 1],
    )
    width, height, rgba, depth, mask = img_arr
    print(f"width : {width}, height: {height}")
    print(f"rgba shape={rgba.shape}, dtype={rgba.dtype}")
    print(f"depth shape={depth.shape}, dtype={depth.dtype}, as values from 0.0 (near) to 1.0 (far)")
    print(
        f"mask shape={mask.shape}, dtype={mask.dtype}, "
        "as unique values from 0 to N-1 entities, and -1 as None"
    )
    return Image.fromarray(rgba)


show_render(p)

# %% 4. How to get robot information

from dataclasses import dataclass


@dataclass
class Joint:
    index: int
    name: str
    type: int
    gIndex: int
    uIndex: int
    flags: int
    damping: float
    friction: float
    lowerLimit: float
    upperLimit: float
    maxForce: float
    maxVelocity: float
    linkName: str
    axis: tuple
    parentFramePosition: tuple
    parentFrameOrientation: tuple
    parentIndex: int

    def __post_init__(self):
        self.name = str(self.name, "utf-8")
        self.linkName = str(self.linkName, "utf-8")


# Let's analyze the R2D2 droid!
print(f"r2d2 unique ID: {r2d2}")
for i in range(p.getNumJoints(r2d2)):
    joint = Joint(*p.getJointInfo(r2d2, i))
    print("\t", joint)

# %% 5. How to set customized terrain

import random


def set_height_field(p):
    random.seed(10)
    heightPerturbationRange = 0.5
    numHeightfieldRows = 256
    numHeightfieldColumns = 256
    heightfieldData = [0] * numHeightfieldRows * numHeightfieldColumns
    for j in range(int(numHeightfieldColumns / 2)):
        for i in range(int(numHeightfieldRows / 2)):
            height = random.uniform(0, heightPerturbationRange)
            heightfieldData[2 * i + 2 * j * numHeightfieldRows] = height
            heightfieldData[2 * i + 1 + 2 * j * numHeightfieldRows] = height
            heightfieldData[2 * i + (2 * j + 1) * numHeightfieldRows] = height
            heightfieldData[2 * i + 1 + (2 * j + 1) * numHeightfieldRows] = height

    terrainShape = p.createCollisionShape(
        shapeType=p.GEOM_HEIGHTFIELD,
        meshScale=[0.3, 0.3, 1],
        heightfieldTextureScaling=(numHeightfieldRows - 1) / 2,
        heightfieldData=heightfieldData,
        numHeightfieldRows=numHeightfieldRows,
        numHeightfieldColumns=numHeightfieldColumns,
    )
    terrain = p.createMultiBody(0, terrainShape)
    p.resetBasePositionAndOrientation(terrain, [0, 0, 0], [0, 0, 0, 1])
    return terrain


p.resetSimulation()
terrain = set_height_field(p)
husky = p.loadURDF("husky/husky.urdf", [1, -1, 1.0])

print(f"husky unique ID: {husky}")
for i in range(p.getNumJoints(husky)):
    joint = Joint(*p.getJointInfo(husky, i))
    print("\t", joint)

show_render(p)

# %% 6. How to set gravity

# Set the gravity to Earth's gravity.
fps = 20
gravity = -9.807
p.setGravity(0, 0, gravity)
p.setTimeStep(1 / fps)

cam_width = 320
cam_height = 200

# Run the simulation for a fixed amount of steps.
images = []
for i in range(20):
    position, orientation = p.getBasePositionAndOrientation(husky)
    x, y, z = position
    roll, pitch, yaw = p.getEulerFromQuaternion(orientation)
    print(
        f"{i:3}: x={x:0.10f}, y={y:0.10f}, z={z:0.10f}), "
        f"roll={roll:0.10f}, pitch={pitch:0.10f}, yaw={yaw:0.10f}"
    )
    cam_view_matrix = p.computeViewMatrixFromYawPitchRoll(
        cameraTargetPosition=[0, 0, 0],
        distance=4,
        yaw=60,
        pitch=-10,
        roll=0,
        upAxisIndex=2,
    )
    cam_projection_matrix = p.computeProjectionMatrixFOV(
        fov=60,
        aspect=cam_width / cam_height,
        nearVal=0.01,
        farVal=100,
    )
    img = p.getCameraImage(cam_width, cam_height, cam_view_matrix, cam_projection_matrix)[2]
    images.append(img)

    p.stepSimulation()

frames = [Image.fromarray(img[..., :3]) for img in images]
frames[0].save("husky_falling.gif", save_all=True, append_images=frames[1:], duration=1000 // fps, loop=0)

# %% 7. How to set the camera

print(p.getDebugVisualizerCamera())

p.resetDebugVisualizerCamera(4, 50, -35, [0, 0, 0])

# %% 8. How to set a local frame

import numpy as np


def set_local_frame(p, robot):
    start, orient, *_ = p.getLinkState(robot, 1)  # 1 is base frame of imu
    rot_mat = np.array(p.getMatrixFromQuaternion(orient)).reshape(3, 3)
    colors = np.eye(3)
    ends = start + rot_mat.T @ colors
    for i, end in enumerate(ends):
        p.addUserDebugLine(start, end, colors[i], lineWidth=2.0, parentObjectUniqueId=husky)


set_local_frame(p, husky)
show_render(p)

# %% 9. Shutting down

p.disconnect()
