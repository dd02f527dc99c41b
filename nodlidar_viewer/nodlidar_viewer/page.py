"""The page: a viser server, and who looks at it."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
from contextlib import AbstractContextManager
import io
from ipaddress import ip_address
import socket
from typing import Any
from urllib.parse import urlsplit

from nodlidar_common.errors import ParameterError
from nodlidar_viewer.config import ViewerConfig
from nodlidar_viewer.scene import BY_AGE, BY_HEIGHT, Scene
import viser

ONLY_LOOKS = 'Controls are shown on the machine of the sensor only (`remote_control`).'
# From behind and above, on the nod axis of the robot.
CAMERA, LOOK_AT = (-3.8, -2.4, 3.8), (1.5, 0.0, 0.6)


class _Server(viser.ViserServer):
    """A server that nobody can share through a tunnel to the Internet."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Refuse."""


class Page:
    """The page.

    Parameters
    ----------
    config
        Address, and who may control.
    on_save
        Returns the shown points as a file: name and content.
    on_open
        Called when a browser opens the page. This and the next one run in threads of the server.
    on_controller
        Called with each browser that may control the sensor.

    Attributes
    ----------
    scene
        Its three-dimensional part.

    Raises
    ------
    ParameterError
        If the host is no address of this machine.
    """

    def __init__(
        self,
        config: ViewerConfig,
        on_save: Callable[[], tuple[str, bytes]],
        on_open: Callable[[], object] = lambda: None,
        on_controller: Callable[[viser.ClientHandle], object] = lambda client: None,
    ) -> None:
        self._config, self._on_open, self._on_controller = config, on_open, on_controller
        _check_host(config.host)
        with contextlib.redirect_stdout(io.StringIO()):  # viser prints a table
            self._server = _Server(host=config.host, port=config.port, verbose=False)
        self._server.initial_camera.position = CAMERA
        self._server.initial_camera.look_at = LOOK_AT
        self.scene = Scene(self._server.scene)
        self._add_buttons(on_save)
        self._server.on_client_connect(self._connected)

    @property
    def address(self) -> str:
        """The address for a browser on this machine."""
        return web_address(self._config.host, self._server.get_port())

    @property
    def gui(self) -> viser.GuiApi:
        """Its part beside the scene."""
        return self._server.gui

    @property
    def is_watched(self) -> bool:
        """Whether any browser has the page open."""
        return bool(self._server.get_clients())

    def at_once(self) -> AbstractContextManager[None]:
        """Return a context whose changes all browsers show in one picture."""
        return self._server.atomic()

    def stop(self) -> None:
        """Close the page."""
        self._server.stop()

    def _add_buttons(self, on_save: Callable[[], tuple[str, bytes]]) -> None:
        gui = self._server.gui
        gui.configure_theme(show_share_button=False, show_logo=False)
        gui.main_panel.dock_right()
        gui.set_panel_label('nodlidar')
        colour = gui.add_dropdown('Colour by', (BY_HEIGHT, BY_AGE), hint='of the latest points')
        save = gui.add_button('Save the points (PLY)', hint='the latest points, to this computer')

        @colour.on_update
        def _(_: object) -> None:
            self.scene.colour_by = colour.value

        @save.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                name, content = on_save()
                event.client.send_file_download(name, content, save_immediately=True)

    def _connected(self, client: viser.ClientHandle) -> None:
        self._on_open()
        if self._config.remote_control or self._is_local(client):
            self._on_controller(client)
        else:
            client.gui.add_markdown(ONLY_LOOKS)

    def _is_local(self, client: viser.ClientHandle) -> bool:
        """Return whether a browser and the page that it shows are of this machine.

        A page of another site that a local browser has open could connect as well: its
        requests have another origin.
        """
        # viser has no interface for it; without what is used here, no browser is local.
        server = getattr(self._server, '_websock_server', None)
        connection = getattr(server, '_live_connections', {}).get(client.client_id)
        try:
            address = ip_address(connection.remote_address[0])  # type: ignore[union-attr]
            headers = connection.request.headers  # type: ignore[union-attr]
        except (AttributeError, TypeError, ValueError):
            return False
        return is_local(str(address), headers.get('Origin'), headers.get('Host'))


def web_address(host: str, port: int) -> str:
    """Return the address for a browser on this machine of a page served on a host and port."""
    here = {'0.0.0.0': 'localhost', '::': '::1'}.get(host, host)
    return f'http://[{here}]:{port}' if ':' in here else f'http://{here}:{port}'


def _check_host(host: str) -> None:
    """Raise ParameterError if no page can be served there: viser would wait for it for ever."""
    try:
        family, kind, _, _, (address, *_) = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as probe:
            probe.bind((address, 0))
    except (OSError, UnicodeError) as error:
        raise ParameterError('host', f'an address of this machine ({error})', host) from error


def is_local(address: str, origin: str | None, host: str | None) -> bool:
    """Return whether a connection from an IP address is of this machine and of this page.

    The page must be under a name of this machine: whoever owns another name can let it lead here
    (DNS rebinding), and origin and host are then equal.

    Parameters
    ----------
    address
        Of the browser.
    origin, host
        Headers of its request: the site of the page that connects, and this server.
    """
    ip = ip_address(address)
    mapped = getattr(ip, 'ipv4_mapped', None)
    if not (mapped or ip).is_loopback:
        return False
    if host is None or not _is_own_name(host):
        return False
    return origin is None or urlsplit(origin).netloc == host


def _is_own_name(host: str) -> bool:
    """Return whether a host, with or without a port, is a name or address of this machine."""
    try:
        name = urlsplit(f'//{host}').hostname or ''
        return name in ('localhost', socket.gethostname().lower()) or ip_address(name).is_loopback
    except ValueError:  # neither a name nor an address
        return False
