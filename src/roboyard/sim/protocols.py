"""Members that lower files of the simulator use of objects which are defined above them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from roboyard.description.model import RobotDescription
from roboyard.sim.build.mesh_assets import MeshAssets
from roboyard.sim.build.planned import PlannedBody
from roboyard.sim.build.records import BodyRows, Built
from roboyard.transforms import Array

if TYPE_CHECKING:
    from roboyard.sim.pool.lone_bodies import LoneBody


AnchorPlaces = tuple[set[tuple[int, int]], tuple[int, int], np.ndarray, list[int]]
"""Keys of anchored links, that of one link, and the (ngeom,) anchors with its rows."""


class EngineBody(Protocol):
    """The members of a `Body` that the engine and the body pool use."""

    id: int
    form: Built | PlannedBody
    description: RobotDescription | None
    mujoco_ids: np.ndarray

    def dofs_of(self, joint: int) -> slice:
        """Return the rows of a joint in qvel."""
        ...

    @property
    def built(self) -> Built:
        """Its elements in the spec, which it gets now where it is only planned."""
        ...

    def build(self, spec: Any, assets: MeshAssets) -> None:
        """Add the elements of a planned body to the spec."""
        ...

    def plan_now(self) -> PlannedBody | None:
        """Return the plan of which elements like the present ones can be built; None where there is none."""
        ...

    def set_frictions(self, plan: PlannedBody) -> None:
        """Set the coefficients of friction of a plan."""
        ...

    @property
    def plan_of_elements(self) -> PlannedBody | None:
        """The plan that its elements agree with but for friction; None where they may not."""
        ...

    def plan_again(self, plan: PlannedBody) -> None:
        """Let the elements be built again, of a plan."""
        ...

    def take_over(self, plan: PlannedBody, built: Built) -> None:
        """Let the elements be those of another body that was built of such a plan."""
        ...

    def refresh(self, model: Any) -> None:
        """Look up the body's rows in the arrays of a compiled model."""
        ...

    def rows(self) -> BodyRows:
        """Return the body's rows in the arrays of the compiled model."""
        ...

    def take_rows(self, rows: BodyRows) -> None:
        """Take the rows of another body that had the same elements."""
        ...

    @property
    def placed(self) -> tuple[Array, Array] | None:
        """Position (3,) (m) and quaternion (4,) while a compile is awaited, which does not change them."""
        ...

    @property
    def plan_of_tree(self) -> PlannedBody | None:
        """The plan that links and joints agree with; None where there is none."""
        ...

    def take_state(self, lone: LoneBody) -> None:
        """Take over the state that the body has alone."""
        ...


class PoolEngine(Protocol):
    """The members of an `Engine` that its body pool uses."""

    @property
    def raw_spec(self) -> Any:
        """The spec, inactive bodies included."""
        ...

    @property
    def assets(self) -> MeshAssets:
        """The meshes of the spec."""
        ...

    is_kept: bool

    @property
    def element_edits(self) -> int:
        """Number of edits of the spec's elements so far, but for those of friction."""
        ...

    @property
    def body_by_id(self) -> dict[int, Any]:
        """All bodies, by id."""
        ...

    @property
    def live_model(self) -> Any:
        """The compiled MjModel, rows of inactive bodies included."""
        ...

    @property
    def live_data(self) -> Any:
        """The MjData of `live_model`."""
        ...

    @property
    def is_stale(self) -> bool:
        """Whether the spec was edited since the last compile."""
        ...

    @property
    def avoided_compiles(self) -> int:
        """Number of new bodies that were read alone since the last compile."""
        ...

    @property
    def time(self) -> float:
        """Simulated time (s)."""
        ...

    @property
    def timestep(self) -> float:
        """Time step (s)."""
        ...

    def mark_stale(self) -> None:
        """Compile before the next use."""
        ...

    def would_be_pile(self, *, more_dofs: int) -> bool:
        """Whether the world would be solved as a pile with so many degrees of freedom of free bases more."""
        ...


class JointDrives(Protocol):
    """The drives of a world, as `Joint` uses them; see `roboyard.sim.actuation.drives`."""

    def position(
        self,
        joint: Any,
        target: float,
        velocity: float,
        stiffness: float | None,
        damping: float | None,
        max_effort: float | None,
    ) -> None:
        """Drive a joint towards a position (rad or m)."""
        ...

    def velocity(self, joint: Any, target: float, damping: float | None, max_effort: float | None) -> None:
        """Drive a joint towards a velocity (rad/s or m/s)."""
        ...

    def effort(self, joint: Any, effort: float) -> None:
        """Apply an effort (N m or N)."""
        ...

    def disable(self, joint: Any) -> None:
        """Let the joint move freely."""
        ...

    def applied(self, joint: Any) -> float:
        """Return the effort of the last step (N m or N)."""
        ...


class LinkSurfaces(Protocol):
    """Restitution and drag of links, as `Link` uses them; see `roboyard.sim.stepping.surfaces`."""

    def restitution(self, link: Any) -> float:
        """Return a link's coefficient of restitution."""
        ...

    def set_restitution(self, link: Any, value: float) -> None:
        """Set a link's coefficient of restitution, 0 to 1."""
        ...

    def set_damping(self, link: Any, linear: float, angular: float) -> None:
        """Set a link's drag coefficients (1/s)."""
        ...

    def set_compliance(self, link: Any, stiffness: float, damping: float) -> None:
        """Make the surface of a link a spring (N/m) and damper (N s/m)."""
        ...

    @property
    def anchors(self) -> np.ndarray:
        """(ngeom,) 1 for the geoms of links with anchors."""
        ...

    def set_anchor(self, link: Any, *, is_anchored: bool) -> None:
        """Let friction pull the contacts of a link back to where they began."""
        ...

    def anchor_places(self, link: Any) -> AnchorPlaces:
        """Return where it is noted whether a link is anchored: keys, its key, (ngeom,) anchors, rows."""
        ...

    def restitution_places(self, link: Any) -> list[Array] | None:
        """Return views (1,) of all places with a link's restitution; None where some do not exist yet."""
        ...

    def compliance_places(self, link: Any) -> list[Array] | None:
        """Return views (2,) of all places with a link's stiffness (N/m) and damping (N s/m), or None."""
        ...

    def damping_places(self, link: Any) -> list[Array] | None:
        """Return views (4,) of all places with a link's drag (1/s), or None."""
        ...


class LinkWrenches(Protocol):
    """External forces, as links and states use them; see `roboyard.sim.stepping.wrenches`."""

    pending: bool
    """Whether an external force acts in the next step."""
    pushed: bool
    """Whether it acts on a link."""

    def find(self) -> None:
        """Note which forces MuJoCo's arrays hold, after they were written in other ways."""
        ...

    def add(self, link: Any, force: Any, torque: Any, point: Any, local: bool) -> None:
        """Add a force (N) and a torque (N m) on a link for the next step."""
        ...
