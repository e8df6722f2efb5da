"""Audit the vendor's URDF, repair it, and copy it with all its files into the build folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from roboyard.audit import ERROR, Finding
from roboyard.description.evidence.read import read_evidence
from roboyard.description.loader import load_description
from roboyard.description.model import Geometry, Mesh, RobotDescription, Vector3
from roboyard.description.robot_model import RobotModel
from roboyard.description.semantic import SemanticDescription
from roboyard.description.semantic_names import with_names
from roboyard.errors import ConfigError, DescriptionError
from roboyard.importer.context import ImportContext
from roboyard.importer.missing_meshes import without_missing_meshes
from roboyard.importer.stated_parts import with_stated_parts
from roboyard.importer.steps.names import planned_names, renamed
from roboyard.morphology.analyze import infer_semantics
from roboyard.morphology.sensors.views import with_camera_views
from roboyard.morphology.upright import turn_to_upright, turned
from roboyard.repair import Repair, repair_urdf
from roboyard.transforms import quaternion_from_matrix

MAX_LINKS = 1000
"""Largest number of links; sphere fitting would take days for more."""
KEPT = ("link-name-odd", "joint-name-odd")
"""Codes of findings that repair must not fix; `names` handles them."""

NO_FILE = ("mesh-missing", "mesh-outside")
"""Codes reported for the vendor's file, because the searched folders only make sense there."""


def repair_and_copy_files(context: ImportContext) -> RobotModel:
    """Return the repaired robot; its meshes and images are in `build/urdf` under plain names.

    Raises:
        DescriptionError: the robot cannot be used even after repair.
        ConfigError: the robot is too large to import.
    """
    links = len(context.source.links)
    if links > MAX_LINKS:
        raise ConfigError(
            f"{context.urdf.name}: {links} links are more than an import allows ({MAX_LINKS}); "
            "split the robot"
        )
    source = without_missing_meshes(context.source, context.config.missing_meshes, context.log)
    made = repair_urdf(source, context.urdf_folder, keep=KEPT)
    _record(context, made)
    remaining = [f for f in made.before.findings if f.code in NO_FILE]
    remaining += [f for f in made.after.findings if f.severity == ERROR and f.code not in NO_FILE]
    if remaining:
        raise DescriptionError.collect([_error(context, made, finding) for finding in remaining])
    description = load_description(made.elements)
    for unused in ("renames.json", "repair_log.json", "repair.diff", made.urdf.name):
        (context.urdf_folder / unused).unlink(missing_ok=True)
    misc = context.build / "misc"
    misc.mkdir(exist_ok=True)
    diff = context.portable(made.diff)
    (misc / "repair.diff").write_text(diff, encoding="utf-8", errors="backslashreplace")
    renames = planned_names(description)
    for kind, plan in (("link", renames.links), ("joint", renames.joints)):
        if plan:
            context.log.warn(_renamed(kind, plan))
            context.log.facts.setdefault("renamed", {})[kind] = dict(plan)
    evidence = read_evidence(description, context.urdf)
    semantic = infer_semantics(description, evidence=evidence)
    turn = turn_to_upright(semantic) if semantic.base_link == description.root.name else None
    if turn is not None:
        up = _axis(semantic.up)
        context.log.note(f"the file has {up} up: planned with z up and x forwards")
        description = turned(description, turn)
        semantic = infer_semantics(description, evidence=evidence)
    semantic = with_names(semantic, renames.links, renames.joints)
    description = renamed(description, renames)
    description = replace(_plain(description), name=context.config.name)
    config = context.config
    grippers = config.curobo.eef_to_gripper_info
    semantic = with_stated_parts(semantic, config.understanding, description, grippers)
    semantic = with_camera_views(semantic, description)
    description = _free_grippers(description, semantic, context)
    x, y, z, w = (0.0, 0.0, 0.0, 1.0) if turn is None else quaternion_from_matrix(turn).tolist()
    return RobotModel(
        name=context.config.name,
        root_turn=(x, y, z, w),
        description=description,
        semantic=semantic,
        category=context.config.category,
        original_names={new: old for plan in (renames.links, renames.joints) for old, new in plan.items()},
    )


def _renamed(kind: str, plan: Mapping[str, str]) -> str:
    """Return one line about all renamed links or joints."""
    some = ", ".join(f"{old!r} is {new}" for old, new in list(plan.items())[:3])
    more = f" and {len(plan) - 3} more" if len(plan) > 3 else ""
    parts = f"{kind}s have names" if len(plan) > 1 else f"{kind} has a name"
    return f"{len(plan)} {parts} that other tools do not accept: {some}{more}"


def _axis(direction: Vector3) -> str:
    """Return the name of the axis nearest to a direction, such as "-y"."""
    values = [*direction, *(-value for value in direction)]
    return ("x", "y", "z", "-x", "-y", "-z")[values.index(max(values))]


def _record(context: ImportContext, made: Repair) -> None:
    log = context.log
    log.facts["source"] = {
        "urdf": str(context.urdf),
        "status": made.before.status,
        "facts": made.before.facts.to_json(),
        "findings": [finding.to_json() for finding in made.before.findings],
    }
    log.facts["fixes"] = [fix.to_json() for fix in made.fixes]
    log.facts["remaining"] = [finding.to_json() for finding in made.left]
    for fix in made.fixes:
        if fix.code not in ("mesh-reference", "mesh-file-name"):
            log.note(f"{fix.before} -> {fix.after} [{fix.code}]", fix.element)
    if made.staged:
        log.note(f"{len(made.staged)} mesh and image files copied under plain names")
    for finding in made.left:
        if finding.severity != ERROR and finding.code not in KEPT:
            log.warn(
                f"{finding.message}; {finding.remedy} [{finding.code}]", finding.element, code=finding.code
            )


def _error(context: ImportContext, made: Repair, finding: Finding) -> DescriptionError:
    """Return the finding as an error of the vendor's file, with that file's line."""
    twins = [f for f in made.before.findings if (f.code, f.element) == (finding.code, finding.element)]
    line = next((twin.line for twin in twins if twin.message == finding.message), None)
    line = line or next((twin.line for twin in twins), None)
    remedy = finding.remedy
    if finding.code == "mesh-missing":
        remedy += "; or import without it: --missing-meshes warn"
    return DescriptionError(
        f"{finding.message}; {remedy}",
        file=context.urdf,
        line=line,
        element=finding.element or None,
    )


def _plain(description: RobotDescription) -> RobotDescription:
    """Return the description without robot-level XML of other tools, which may use the old names."""
    links = tuple(
        replace(
            link,
            visuals=tuple(replace(v, geometry=_local(v.geometry)) for v in link.visuals),
            collisions=tuple(replace(c, geometry=_local(c.geometry)) for c in link.collisions),
        )
        for link in description.links
    )
    return replace(description, links=links, extra=())


def _local(geometry: Geometry) -> Geometry:
    if isinstance(geometry, Mesh) and geometry.path is not None:
        return replace(geometry, path=geometry.path.absolute())
    return geometry


def _free_grippers(
    description: RobotDescription, semantic: SemanticDescription, context: ImportContext
) -> RobotDescription:
    """Return the description with every listed gripper joint driven: no mimic, no limits of zero.

    Without a list they are the joints that are understood to drive the grippers.
    """
    named = {joint for g in context.config.curobo.eef_to_gripper_info.values() for joint in g.joints}
    named = named or {joint for effector in semantic.end_effectors for joint in effector.gripper_joints}
    joints = []
    for joint in description.joints:
        if joint.name in named:
            who = f'joint "{joint.name}"'
            if joint.mimic is not None:
                context.log.note(
                    f"no longer mimics {joint.mimic.joint!r}: the gripper drives each finger", who
                )
                joint = replace(joint, mimic=None)
            limit = joint.limit
            if limit is not None and (limit.effort == 0 or limit.velocity == 0):
                effort = GRIPPER_EFFORT if limit.effort == 0 else limit.effort
                velocity = (
                    GRIPPER_VELOCITY[joint.type == "prismatic"] if limit.velocity == 0 else limit.velocity
                )
                context.log.warn(
                    f"effort or velocity limit 0 locks the joint; assumed {effort:g} and {velocity:g}; "
                    f"set the real limits in the URDF",
                    who,
                )
                joint = replace(joint, limit=replace(limit, effort=effort, velocity=velocity))
        joints.append(joint)
    return replace(description, joints=tuple(joints))


GRIPPER_EFFORT = 100.0
"""Effort limit that OmniGibson assumes for a joint without one (N or N m)."""
GRIPPER_VELOCITY = (15.0, 1.0)
"""Velocity limits that OmniGibson assumes for revolute and prismatic joints (rad/s and m/s)."""
