"""`Viewer`: a live view of a world on a web page."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from roboyard._arrays import ArrayLike
from roboyard.sim.queries.default_view import fitted_points
from roboyard.viewer.bar.bar import Bar, Controls
from roboyard.viewer.bar.contact_forces import BLUE, ForceArrows, force_arrows
from roboyard.viewer.bar.start_state import StartState
from roboyard.viewer.bar.step_gate import StepGate
from roboyard.viewer.notebook import frame_html
from roboyard.viewer.page.first_view import FirstView
from roboyard.viewer.page.last_used import LastUsed
from roboyard.viewer.page.light import set_light
from roboyard.viewer.page.server import DEFAULT_PORT, open_server, stop_server
from roboyard.viewer.scene.drawings import Drawing, Drawings
from roboyard.viewer.scene.grab import Grab
from roboyard.viewer.scene.scene_nodes import SceneNodes
from roboyard.viewer.scene.snapshot import Links, PoseSender, Snapshot, corners_of, gather_links, take
from roboyard.viewer.scene.uncompiled import with_uncompiled
from roboyard.viewer.timeline.moments import Moments
from roboyard.viewer.timeline.playback import Playback
from roboyard.viewer.timeline.signal_folder import SignalFolder
from roboyard.viewer.timeline.time_folder import TimeFolder

if TYPE_CHECKING:
    from roboyard.sim import World
    from roboyard.sim.body import Body
    from roboyard.sim.link import Link

log = logging.getLogger(__name__)

GRAB_KEY = "cmd/ctrl"
"""Key with which the mouse drags a body instead of the camera."""
RATE, LOW_RATE = 60.0, 30.0
"""Largest rate of updates, and that while all pages draw in low quality (Hz)."""


class Viewer:
    """A page that shows a world while it is stepped; any number of browsers may open it.

    Stepping never blocks on a browser: at the end of `World.step` the joint positions are copied, and the
    viewer's own thread sends the changed poses, up to 60 times per second. Without an open page nothing is
    copied. Changes without a step (a joint position set by hand, say) are shown by `sync`.

    Every program that can reach the port can see the world, so a viewer listens on this machine only by
    default. Over SSH, forward the port: `ssh -L 8080:localhost:8080 host`.
    """

    def __init__(
        self,
        world: World,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        *,
        title: str = "Roboyard",
        quiet: bool = False,
        on_click: Callable[[tuple[int, int]], None] | None = None,
        follow_steps: bool = True,
    ) -> None:
        """Open the page of a world; call it from the simulation thread.

        Args:
            world: the world to show.
            host: address to listen on; "0.0.0.0" is every network of this machine.
            port: first port to try; if it is in use, the next free one is used.
            title: heading of the page's panel.
            quiet: do not print the address.
            on_click: called with body id and link index of a clicked shape, in a thread of the server.
            follow_steps: show the world after each `World.step`; False: only at each `sync`.

        Raises:
            MissingExtraError: viser is not installed; it is part of the extra `gui`.
            ConfigError: this machine has no address `host`, or no port is free.
        """
        self.world = world
        self.server: Any = open_server(host, port, title)
        """The `viser.ViserServer`, to which panels and shapes can be added."""
        self.host = host
        self.port: int = self.server.get_port()
        self.nodes = SceneNodes(self.server.scene)
        self.nodes.on_click = on_click
        self.drawings = Drawings(self.server)
        self.before_frame: list[Callable[[], None]] = []
        """Called in the viewer's own thread before each update, while a page is open."""
        self.rate = RATE
        """Largest rate of updates (Hz)."""
        self.watchers = 0
        """Number of open pages."""
        self.frames_sent = 0
        """Number of updates sent so far."""
        self._links = Links(paths={}, rows={}, by_owner={})
        self._revision = -1
        self._is_fit_due = False
        self.start_state = StartState()
        """The state to which the bar's reset returns."""
        self.grab = Grab()
        """The body that is dragged with the mouse, Ctrl held."""
        self._latest: Snapshot | None = None
        self._published: Snapshot | None = None
        self._pose_sender = PoseSender()
        self._poses: tuple[Any, Any] | None = None
        self._drawing = self._drawn = Drawing()
        self._follow_steps = follow_steps
        self._publishing = threading.Lock()
        self._counting = threading.Lock()
        self._wake = threading.Event()
        self._closing = threading.Event()
        self.light = set_light(self.server)
        self.first_view = FirstView(self.server, lambda: fitted_points(self.world.bodies))
        """Aims the camera of each page when it opens."""
        self.last_used = LastUsed(self.server)
        """Which page was used last."""
        self.gate = StepGate(lambda: self.watchers > 0, self._on_gate)
        """Pauses, slows and single-steps the thread that steps the world, as the bar of the page asks."""
        self.bar = Bar(self.server, title, self._controls(), speed=None)
        """Bar of the page, with play, step, reset, speed, views, contact forces, pictures and films."""
        self._low: set[int] = set()
        """Numbers of the clients that draw in low quality."""
        self.bar.on_quality = self._on_quality
        self.moments = Moments()
        """The last minute of the world, recorded while a page is open."""
        self.playback = Playback(self.moments)
        """Which recorded state the pages show."""
        self.time_folder = TimeFolder(self.server.gui, self.moments, self.playback)
        """The controls of `playback` in the panel."""
        self.signal_folder = SignalFolder(self.server.gui, self.moments, self.playback)
        """A plot of a recorded signal in the panel."""
        self._arrows = ForceArrows(self.server.scene)
        self._pull = ForceArrows(self.server.scene, "pull", BLUE)
        if follow_steps:
            self.nodes.set_drag(self.grab.on_drag, (GRAB_KEY,))
        self.sync(wait=True)
        if follow_steps:
            world.after_step.append(self._after_step)
        self.server.on_client_connect(self._on_connect)
        self.server.on_client_disconnect(self._on_disconnect)
        self._thread = threading.Thread(target=self._publish_forever, name="roboyard-viewer", daemon=True)
        self._thread.start()
        if not quiet:
            print(f"{title} is at {self.url}", flush=True)

    def __repr__(self) -> str:
        state = "closed" if self._closing.is_set() else f"{self.watchers} watching"
        return f"<Viewer at {self.url}: {state}>"

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def url(self) -> str:
        """Address of the page on this machine."""
        host = "localhost" if self.host in ("0.0.0.0", "::", "") else self.host  # noqa: S104
        return f"http://[{host}]:{self.port}" if ":" in host else f"http://{host}:{self.port}"

    def sync(self, *, wait: bool = False) -> None:
        """Show the current state without a step; call it from the simulation thread.

        With `wait` it returns after the messages are queued; browsers receive them asynchronously.
        """
        self._take()
        if wait:
            self._publish()

    def show_uncompiled(self, body: Body, joint_positions: Mapping[str, float]) -> threading.Thread:
        """Send a body of a description, added at the origin, while the caller lets the world be compiled.

        The page shows it standing on the plane z = 0 until the next `sync`, before which the caller joins the
        returned thread. Call it from the simulation thread.

        Args:
            body: the body.
            joint_positions: of its joints (rad or m); others are at zero or follow their leaders.
        """
        assert self._latest is not None
        assert self._poses is not None
        self._latest, points = with_uncompiled(self.world, self._latest, self._poses, body, joint_positions)
        self.first_view.aim(points)
        sending = threading.Thread(target=self._publish, name="roboyard-uncompiled", daemon=True)
        sending.start()
        return sending

    def look_at(self, point: ArrayLike, distance: float) -> None:
        """Aim the camera of every page at a (3,) point in the world frame (m), from `distance` (m) away."""
        target = np.asarray(point, dtype=float)
        for client in self.server.get_clients().values():
            camera = client.camera
            away = np.asarray(camera.position) - np.asarray(camera.look_at)
            away[2] = max(away[2], 0.0)  # not from below the floor
            away /= max(float(np.linalg.norm(away)), 1e-9)
            with client.atomic():
                camera.position = target + distance * away
                camera.look_at = target

    def show_world(self, world: World) -> None:
        """Show another world instead of this one and fit it into the frame.

        Call it from the simulation thread.
        """
        if world is self.world:
            return
        self._unfollow()
        self.world, self._revision = world, -1
        self.playback.go_live()
        self.moments.clear()
        self.moments.sensors.clear()
        if self._follow_steps:
            world.after_step.append(self._after_step)
        self.sync()
        self.first_view.aim()

    def draw(self, drawing: Drawing) -> None:
        """Replace the lines and texts with the next update; may be called from any thread."""
        self._drawing = drawing

    def highlight(self, link: Link | None) -> None:
        """Draw one link in the highlight colour; None: no link."""
        with self._publishing, self.server.atomic():
            self.nodes.tint(None if link is None else (link.body.id, link.index))

    def show_visuals(self, visible: bool) -> None:
        """Show or hide the visual shapes of bodies, except floors."""
        with self._publishing, self.server.atomic():
            self.nodes.set_visible(visible)

    def show_link(self, link: Link, visible: bool) -> None:
        """Show or hide the visual shapes of one link."""
        with self._publishing, self.server.atomic():
            self.nodes.hide((link.body.id, link.index), not visible)

    def fade_link(self, link: Link, opacity: float) -> None:
        """Draw the visual shapes of one link with a share of their opacity, up to 1."""
        with self._publishing, self.server.atomic():
            self.nodes.fade((link.body.id, link.index), opacity)

    def path_of(self, link: Link) -> str:
        """Return the path of a link's frame in the page's scene; nodes added below it move with the link."""
        return self._links.paths[(link.body.id, link.index)]

    def close(self) -> None:
        """Close the page; the world is unchanged."""
        if self._closing.is_set():
            return
        self._closing.set()
        self.gate.close()
        self._unfollow()
        self._wake.set()
        self._thread.join(timeout=2.0)
        stop_server(self.server)

    def _repr_html_(self) -> str:
        return frame_html(self.url)

    # -------------------------------------------------------------------------- in the simulation thread

    def _unfollow(self) -> None:
        if self._follow_steps and self._after_step in self.world.after_step:
            self.world.after_step.remove(self._after_step)

    def _after_step(self) -> None:
        if self.watchers or self.world.revision != self._revision:
            self._take()
        self.gate.wait(self.world.time)
        if self.grab.is_pending:
            self.grab.apply(self.world, self.world.timestep)

    def _reset(self) -> None:
        """Restore the state after which bodies were last added or removed."""
        self.grab.release(self.world)
        if self.start_state.restore(self.world):
            self._take()

    def _take(self) -> None:
        world = self.world
        model = world.model  # first: this empties the body pool and may renumber the bodies
        if world.revision != self._revision:
            self._links = gather_links(world)
            self._is_fit_due = self._revision >= 0
            self._revision = world.revision
            if self._follow_steps:
                self.start_state.keep(world, is_held=self.grab.is_holding)
        if self._is_fit_due and self.watchers:
            self._is_fit_due = False
            self.first_view.refit()
        forces = force_arrows(world, self._links) if self.bar.shows_forces else None
        latest = take(world, model, self._links, forces=forces, pull=self.grab.arrow())
        with self._counting:
            self._latest = latest
        if self.watchers:
            self.moments.record(world, latest)

    # ------------------------------------------------------------------------------- in the server's threads

    async def _on_connect(self, _: Any) -> None:
        # coroutines: at exit the thread pool for plain functions ends before the pages close
        with self._counting:
            self.watchers += 1
            first = self.watchers == 1
        latest = self._latest
        if first and latest is not None:
            # nothing was copied without an open page: copy now, in case the world is no longer stepped
            now = latest.now()
            with self._counting:
                if self._latest is latest:  # no newer one was taken meanwhile
                    self._latest = now
        self._wake.set()

    async def _on_disconnect(self, client: Any) -> None:
        self.grab.drop(client.client_id)
        with self._counting:
            self._low.discard(client.client_id)
            self.watchers -= 1
            if not self.watchers:
                self.playback.go_live()

    def _controls(self) -> Controls:
        """Return controls for a world that is stepped elsewhere."""
        gate = self.gate
        return Controls(
            play=gate.play,
            step=gate.step,
            reset=lambda: gate.do(self._reset),
            set_speed=gate.set_speed,
            home=self.go_home,
            refresh=lambda: gate.do(self._take),
        )

    def _on_quality(self, client: int, quality: str) -> None:
        """Send full meshes once a page draws in more than low quality."""
        with self._counting:
            (self._low.add if quality == "low" else self._low.discard)(client)
        if quality != "low":
            self.nodes.is_detailed = True

    def _on_gate(self, gate: StepGate) -> None:
        self.bar.show(playing=gate.playing, speed=gate.speed)

    def go_home(self, client: Any) -> None:
        """Move the camera of one page (a `viser.ClientHandle`) so that it shows all bodies as they are."""
        with self._publishing:
            snapshot, poses = self._published, self._poses
            points = None if snapshot is None or poses is None else corners_of(snapshot, *poses)
        self.first_view.home(client, points)

    # ----------------------------------------------------------------------------- in the viewer's own thread

    def _publish_forever(self) -> None:
        while not self._closing.is_set():
            if not self.watchers:
                self._wake.wait(timeout=1.0)
                self._wake.clear()
                continue
            start = perf_counter()
            try:
                for call in tuple(self.before_frame):
                    call()
                self._publish()
                if self._latest is not None:
                    self.bar.show_time(self._latest.time)
                self.time_folder.tick()
                self.signal_folder.tick()
            except Exception:
                if self._closing.is_set():
                    return
                log.exception("an update of the viewer failed")
            rate = min(self.rate, LOW_RATE if len(self._low) >= self.watchers else self.rate)
            self._closing.wait(timeout=max(start + 1.0 / rate - perf_counter(), 0.001))

    def _publish(self) -> None:
        with self._publishing:
            snapshot, drawing = self.playback.shown() or self._latest, self._drawing
            self.nodes.refine()
            if snapshot is None or (snapshot is self._published and drawing is self._drawn):
                return
            with self.server.atomic():
                if snapshot is not self._published or self._poses is None:
                    self.nodes.show(snapshot.shapes, snapshot.links)
                    self._poses = snapshot.poses or self._pose_sender.poses(snapshot.model, snapshot.qpos)
                    self.nodes.move(*self._poses)
                self.drawings.show(drawing, snapshot.links.by_owner, *self._poses)
                self._arrows.show(snapshot.forces)
                self._pull.show(snapshot.pull)
            self._published, self._drawn = snapshot, drawing
            self.frames_sent += 1
