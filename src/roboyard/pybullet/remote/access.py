"""Who may use a server: the token, and the options string in which a client gives it."""

from __future__ import annotations

import ipaddress
import os
import secrets
import shlex

from roboyard.errors import ConfigError
from roboyard.pybullet.face.wire import MAX_TOKEN

VARIABLE = "ROBOYARD_TOKEN"
"""Environment variable with the token, for servers and clients."""


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches an address."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.partition("%")[0]).is_loopback
    except ValueError:
        return False


def server_token(host: str, token: str = "") -> str:
    """Return the token of a server: the given one, else a new one for an address that others reach, else "".

    Raises:
        ConfigError: the token is too long, or has characters that cannot be typed.
    """
    token = token or os.environ.get(VARIABLE, "")
    if token:
        if len(token.encode("utf-8", "replace")) > MAX_TOKEN or not token.isprintable() or " " in token:
            raise ConfigError(
                f"--token: at most {MAX_TOKEN} characters without blanks, got {len(token)}; shorten it"
            )
        return token
    return "" if is_loopback(host) else secrets.token_urlsafe(18)


def token_of(options: str) -> str:
    """Return the token in the options of connect ("--token=TOKEN"), else that of the environment, else ""."""
    try:
        words = shlex.split(options)
    except ValueError:
        words = options.split()
    for word in words:
        name, _, value = word.partition("=")
        if name == "--token":
            return value
    return os.environ.get(VARIABLE, "")
