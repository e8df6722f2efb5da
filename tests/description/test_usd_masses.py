"""Masses of bodies in USD stages against OpenUSD's own computation and a tensor in numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pxr")

from pxr import Gf, Usd, UsdGeom, UsdPhysics, UsdShade  # type: ignore[import-not-found]

from roboyard.description import load_description
from roboyard.transforms import Array


def _affine(prim: Any) -> Array:
    return np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim), dtype=float).T


def _of_unit_density(prim: Any) -> Any:
    """Return what OpenUSD asks for each collider, here a cube below its body."""
    T_body, T = _affine(prim.GetParent()), _affine(prim)
    T_body[:3, :3] /= np.linalg.norm(T_body[:3, :3], axis=0)
    T = np.linalg.inv(T_body) @ T
    scale = np.linalg.norm(T[:3, :3], axis=0)
    x, y, z = UsdGeom.Cube(prim).GetSizeAttr().Get() * scale
    out = UsdPhysics.RigidBodyAPI.MassInformation()
    out.volume, out.centerOfMass = float(x * y * z), Gf.Vec3f(0)
    out.localPos = Gf.Vec3f(*map(float, T[:3, 3]))
    turn = Gf.Matrix3d(*(T[:3, :3] / scale).T.flatten().tolist()).ExtractRotation()
    out.localRot = Gf.Quatf(turn.GetQuat())
    moments = np.array([y * y + z * z, x * x + z * z, x * x + y * y]) * x * y * z / 12
    out.inertia = Gf.Matrix3f(*np.diag(moments).flatten().tolist())
    return out


def _state_some(prim: Any, generator: np.random.Generator) -> None:
    """State a part of what MassAPI holds."""
    api = UsdPhysics.MassAPI.Apply(prim)
    states = generator.random(4) < 0.4
    if states[0]:
        api.CreateMassAttr(float(generator.uniform(1, 5)))
    if states[1]:
        api.CreateDensityAttr(float(generator.uniform(500, 2000)))
    if states[2]:
        api.CreateCenterOfMassAttr(Gf.Vec3f(*map(float, generator.uniform(-0.2, 0.2, 3))))
    if states[3]:
        api.CreateDiagonalInertiaAttr(Gf.Vec3f(*map(float, generator.uniform(0.4, 0.6, 3))))
        turn = generator.normal(size=4)
        api.CreatePrincipalAxesAttr(Gf.Quatf(*map(float, turn / np.linalg.norm(turn))))


def _placed(prim: Any, generator: np.random.Generator, scale: Array) -> None:
    shape = UsdGeom.Xformable(prim)
    shape.AddTranslateOp().Set(Gf.Vec3d(*generator.uniform(-0.3, 0.3, 3)))
    shape.AddRotateXYZOp().Set(Gf.Vec3f(*map(float, generator.uniform(-90, 90, 3))))
    shape.AddScaleOp().Set(Gf.Vec3f(*map(float, scale)))


@pytest.mark.parametrize("seed", range(40))
def test_masses_that_are_stated_in_part_are_those_of_openusd(tmp_path: Path, seed: int) -> None:
    """One body of up to three cubes; body and cubes state some of mass, density, centre and inertia."""
    generator = np.random.default_rng(seed)
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Z")
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/bot").GetPrim())
    material = UsdShade.Material.Define(stage, "/bot/heavy")
    UsdPhysics.MaterialAPI.Apply(material.GetPrim()).CreateDensityAttr(3000.0)
    body = UsdGeom.Xform.Define(stage, "/bot/base").GetPrim()
    UsdPhysics.RigidBodyAPI.Apply(body)
    _placed(body, generator, np.full(3, generator.choice([1.0, 1.5])))
    _state_some(body, generator)
    for number in range(int(generator.integers(1, 4))):
        cube = UsdGeom.Cube.Define(stage, f"/bot/base/cube{number}")
        cube.CreateSizeAttr(float(generator.uniform(0.1, 0.4)))
        prim = cube.GetPrim()
        UsdPhysics.CollisionAPI.Apply(prim)
        _placed(prim, generator, generator.uniform(0.5, 1.5, 3))
        if generator.random() < 0.3:
            binding = UsdShade.MaterialBindingAPI.Apply(prim)
            binding.Bind(material, UsdShade.Tokens.weakerThanDescendants, "physics")
        if generator.random() < 0.6:
            _state_some(prim, generator)
    file = tmp_path / "bot.usda"
    stage.GetRootLayer().Export(str(file))

    mass, moments, centre, axes = UsdPhysics.RigidBodyAPI(body).ComputeMassProperties(_of_unit_density)
    turn = np.array(Gf.Matrix3d(Gf.Rotation(Gf.Quatd(axes)))).T
    expected = turn @ np.diag(np.array(moments)) @ turn.T
    found = load_description(file).root.inertial
    assert found is not None
    own = found.origin.matrix()[:3, :3]
    assert found.mass == pytest.approx(mass, rel=1e-5)
    np.testing.assert_allclose(found.origin.position, np.array(centre), atol=1e-5)
    np.testing.assert_allclose(own @ found.matrix() @ own.T, expected, atol=1e-4 * np.abs(expected).max())


def test_newtons_tensor_comes_before_principal_moments(tmp_path: Path) -> None:
    """The moments beside it are those of another body; the stage is in centimetres."""
    file = tmp_path / "bot.usda"
    file.write_text("""#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI", "NewtonMassAPI"])
{
    float physics:mass = 2
    point3f physics:centerOfMass = (1, 2, 3)
    float3 physics:diagonalInertia = (1, 1, 1)
    quatf physics:principalAxes = (0.70710677, 0.70710677, 0, 0)
    double[] newton:inertia = [100, 200, 250, 10, 20, 30]
}
""")
    found = load_description(file).root.inertial
    assert found is not None
    expected = np.array([[0.01, 0.001, 0.002], [0.001, 0.02, 0.003], [0.002, 0.003, 0.025]])
    assert found.origin.matrix()[:3, :3] == pytest.approx(np.eye(3))
    np.testing.assert_allclose(found.matrix(), expected, rtol=1e-12)
    np.testing.assert_allclose(found.origin.position, (0.01, 0.02, 0.03), rtol=1e-6)
