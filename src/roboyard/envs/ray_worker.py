"""A batch of environments in a Ray actor, and the line to it.

Ray starts the actor and says where it is; requests and answers then go over a connection of their own, since
each call of an actor costs Ray one or two milliseconds. On the same machine that is a local socket, between
machines a TCP connection with a secret that Ray passes on.
"""

from __future__ import annotations

import pickle
import secrets
import socket
import weakref
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cached_property
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection, Listener
from typing import Any

import numpy as np

from roboyard.envs.task import Task
from roboyard.errors import MissingExtraError, RoboyardError

try:
    import ray  # pyright: ignore[reportMissingImports]
    from ray import cloudpickle  # pyright: ignore[reportMissingImports]
    from ray.exceptions import RayError  # pyright: ignore[reportMissingImports]
except ModuleNotFoundError as error:
    raise MissingExtraError("ray", "cluster", "environments on Ray") from error

WAIT = 120.0
"""Longest time of one step of an actor (s)."""


class WorkerDied(Exception):
    """An actor ended, or does not answer."""


class WorkerLine:
    """An actor and the connection to it, which is made at the first request."""

    def __init__(self, actor: Any, number: int) -> None:
        """Ask an actor where it listens.

        Args:
            actor: Ray's handle of a `Worker`.
            number: of the worker, for messages.
        """
        self.actor, self._number = actor, number
        self._place = actor.listen.remote(_node())
        self._serving = actor.serve.remote()
        self._connection: Connection[Any, Any] | None = None
        self._end = weakref.finalize(self, _kill, actor)

    def send(self, name: str, *arguments: Any) -> None:
        """Ask the worker to call one of its functions; `receive` returns the result.

        Raises:
            WorkerDied: the actor ended.
            RoboyardError: it runs on a machine that cannot be reached from here.
        """
        if self._connection is None:
            self._connection = self._connect()
        try:
            self._connection.send_bytes(pickle.dumps((name, arguments), protocol=5))
        except OSError:
            raise WorkerDied from None

    def receive(self) -> Any:
        """Return the result of the call.

        Raises:
            Exception: what the function raised.
            WorkerDied: the actor ended or does not answer.
        """
        assert self._connection is not None, "nothing was sent"
        try:
            if not self._connection.poll(WAIT):
                raise WorkerDied
            is_good, result = pickle.loads(self._connection.recv_bytes())  # noqa: S301 - from our own actor
        except (EOFError, OSError):
            raise WorkerDied from None
        if not is_good:
            raise result
        return result

    def _connect(self) -> Connection[Any, Any]:
        try:
            address, secret = ray.get(self._place, timeout=WAIT)
        except RayError:
            raise WorkerDied from None
        try:
            connection = Client(address, authkey=secret)
        except (OSError, EOFError) as error:
            if isinstance(address, tuple):
                place = "{}:{}".format(*address)
                raise RoboyardError(
                    f"worker {self._number} at {place} cannot be reached ({error}); "
                    "run this program on a machine of the cluster that the others reach on any port"
                ) from None
            raise WorkerDied from None
        _send_at_once(connection, address)
        return connection

    def close(self) -> None:
        """End the actor."""
        if self._connection is not None:
            self._connection.close()
        self._end()


class Worker:
    """A batch of environments in an actor, built at the first request: an error then is the caller's."""

    def __init__(
        self,
        make: Callable[[], Task],
        count: int,
        first: int,
        threads: int,
        modalities: Sequence[str] | None,
    ) -> None:
        """Note what to build.

        Args:
            make: returns the task.
            count: number of environments.
            first: number of the first one.
            threads: of the processor.
            modalities: as in `BatchEnv`.
        """
        self._make, self._count = make, count
        self._options: dict[str, Any] = {
            "threads": threads,
            "obs_modalities": modalities,
            "first_seed": first,
        }
        self._secret = secrets.token_bytes(32)
        self._listener: Listener | None = None

    @cached_property
    def _envs(self) -> Any:
        from roboyard.envs.vector_env import BatchEnv

        return BatchEnv(self._make(), self._count, **self._options)

    def listen(self, node: str) -> tuple[Any, bytes]:
        """Wait for a connection from a node of the cluster; return where, and the secret that it needs."""
        is_near = node == _node()
        place = None if is_near else (ray.util.get_node_ip_address(), 0)
        self._listener = Listener(place, authkey=self._secret)
        return self._listener.address, self._secret

    def serve(self) -> None:
        """Answer requests until the connection ends."""
        assert self._listener is not None, "listen first"
        with self._listener, self._accept(self._listener) as connection, suppress(EOFError, OSError):
            _send_at_once(connection, self._listener.address)
            while True:
                name, arguments = pickle.loads(connection.recv_bytes())  # noqa: S301 - with our secret
                connection.send_bytes(self._answer(name, arguments))

    def _accept(self, listener: Listener) -> Connection[Any, Any]:
        while True:
            with suppress(AuthenticationError, EOFError, OSError):  # of a stranger: wait on
                return listener.accept()

    def _answer(self, name: str, arguments: tuple[Any, ...]) -> bytes:
        functions = {"spaces": self.spaces, "reset": self.reset, "step": self.step}
        try:
            return pickle.dumps((True, functions[name](*arguments)), protocol=5)
        except Exception as error:
            try:
                return cloudpickle.dumps((False, error))
            except Exception:
                return pickle.dumps((False, RoboyardError(f"{type(error).__name__}: {error}")))

    def spaces(self) -> tuple[Any, Any]:
        """Return observation and action space of one environment."""
        return self._envs.single_observation_space, self._envs.single_action_space

    def reset(self, seed: Any) -> Any:
        """Start episodes and return the observations."""
        return self._envs.reset(seed=seed)[0]

    def step(self, actions: np.ndarray) -> Any:
        """Return the result of a step with actions (n, a)."""
        return self._envs.step(actions)


def _node() -> str:
    """Return the node of the cluster on which this process runs."""
    return ray.get_runtime_context().get_node_id()


def _kill(actor: Any) -> None:
    if ray.is_initialized():
        ray.kill(actor)


def _send_at_once(connection: Connection[Any, Any], address: Any) -> None:
    """Send small messages over TCP without waiting for others."""
    if isinstance(address, tuple):
        with socket.fromfd(connection.fileno(), socket.AF_INET, socket.SOCK_STREAM) as link:
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
