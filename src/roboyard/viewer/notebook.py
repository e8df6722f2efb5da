"""The HTML of a viewer in a notebook, also in one on another machine."""

from __future__ import annotations

import os
from html import escape
from urllib.parse import urlsplit

HEIGHT = 480
"""Height of an embedded page (pixels)."""
VARIABLE = "ROBOYARD_VIEWER_URL"
"""Environment variable with the address under which a proxy serves ports of this machine, with "{port}" for
the port: "/user/me/proxy/{port}/"."""
HUB = "JUPYTERHUB_SERVICE_PREFIX"
"""Environment variable that JupyterHub sets: the path of the user's server, such as "/user/me/"."""


def shown_address(url: str) -> str:
    """Return the address at which the browser of a notebook reaches the page at `url`.

    It is `url` on this machine. Where `ROBOYARD_VIEWER_URL` or JupyterHub name a proxy, it is the address of
    the port there; jupyter-server-proxy serves it at `proxy/PORT/` below the user's path.
    """
    port = urlsplit(url).port
    proxy = os.environ.get(VARIABLE, "")
    if not proxy and os.environ.get(HUB):
        proxy = os.environ[HUB].rstrip("/") + "/proxy/{port}/"
    return proxy.replace("{port}", str(port)) if proxy and port else url


def frame_html(url: str, height: int = HEIGHT) -> str:
    """Return HTML that embeds the page at `url`, `height` pixels high; see `shown_address`."""
    shown = shown_address(url)
    address = escape(shown, quote=True)
    remedy = ""
    if shown == url:
        port = escape(str(urlsplit(url).port or ""))
        remedy = (
            f" If nothing is shown, the notebook runs on another machine: forward the port "
            f"(<code>ssh -L {port}:localhost:{port} host</code>), or set <code>{VARIABLE}</code>."
        )
    return (
        f'<iframe src="{address}" width="100%" height="{height}" frameborder="0" '
        f'title="Roboyard viewer"></iframe><p><a href="{address}" target="_blank">{address}</a>{remedy}</p>'
    )
