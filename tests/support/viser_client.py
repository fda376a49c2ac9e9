"""A page without a browser: speaks the viewer's websocket as viser's own page does, and reads its
controls.
"""

import json
import re
import socket
import time
from contextlib import contextmanager
from html import unescape
from urllib.parse import urlsplit

import msgspec
import viser
import zstandard
from websockets.sync.client import connect

from .browser import until

CAMERA = {
    "type": "ViewerCameraMessage",
    **{
        "wxyz": (1.0, 0.0, 0.0, 0.0),
        "position": (3.0, 0.0, 0.0),
        "fov": 0.7,
        "near": 0.01,
        "far": 100.0,
    },
    **{
        "image_height": 100,
        "image_width": 100,
        "look_at": (0.0, 0.0, 0.0),
        "up_direction": (0.0, 0.0, 1.0),
    },
}


class Client:
    """One connection, which keeps the page's controls: their properties by their uuids, values
    among them. ``drawn`` are the names of what stands in the scene."""

    def __init__(
        self,
        url: str,
        origin: str | None = None,
        host: str = "127.0.0.1",
        query: str = "",
        dark: bool = False,
    ) -> None:
        """``url``: of the server, as printed. ``host``: by what name the page asked for this
        machine. ``query``: of the address with which it was opened. ``dark``: whether the browser
        prefers dark pages."""
        port, token = urlsplit(url).port, urlsplit(url).path
        self._opened = {"address": f"?{query}", "dark": dark}
        self._owners: dict[str, str] = {}
        self.scripts: list[str] = []
        self.eye = self.look_at = (0.0, 0.0, 0.0)
        self._socket = connect(
            f"ws://{host}:{port}{token}",
            sock=socket.create_connection(("127.0.0.1", port)),
            subprotocols=[f"viser-v{viser.__version__}"],
            origin=origin or f"http://{host}:{port}",
            max_size=None,
            compression=None,
        )
        self.controls: dict[str, dict] = {}
        self.drawn: set[str] = set()
        self.send(CAMERA)

    def send(self, message: dict) -> None:
        self._socket.send(msgspec.msgpack.encode(message))

    def report(self, position, width: int) -> None:
        """Say where the camera stands and how many pixels wide the window is; it is 100 high."""
        place = {"position": [*map(float, position)], "look_at": [*map(float, self.look_at)]}
        self.send({**CAMERA, **place, "image_width": width})

    def read(self, seconds: float) -> None:
        """Take in what comes until nothing has come for so long."""
        while True:
            try:
                data = self._socket.recv(timeout=seconds)
            except TimeoutError:
                return
            size = int.from_bytes(data[8:16], "little")
            for message in msgspec.msgpack.decode(
                zstandard.ZstdDecompressor().decompress(data[16 : 16 + size])
            )["messages"]:
                self._take(message)

    def _take(self, message: dict) -> None:
        if message["type"] == "GuiUpdateMessage":
            self.controls.get(message["uuid"], {}).update(message["updates"])
        elif "props" in message and "uuid" in message and message["type"].startswith("Gui"):
            self.controls[message["uuid"]] = {"value": message.get("value"), **message["props"]}
        elif message["type"] == "RemoveSceneNodeMessage":
            self.drawn.discard(message["name"])
        elif message["type"] == "GetRenderRequestMessage":  # a browser that cannot
            self.send(
                {
                    "type": "GetRenderResponseMessage",
                    "payload": b"",
                    "render_uuid": message["render_uuid"],
                }
            )
        elif message["type"] == "LocalStorageGetItemRequestMessage":
            self.send(
                {
                    "type": "LocalStorageGetItemResponseMessage",
                    "value": json.dumps(self._opened),
                    "error": None,
                    "request_uuid": message["request_uuid"],
                }
            )
        elif message["type"] == "SetCameraPositionMessage":
            self.eye = tuple(message["position"])
        elif message["type"] == "SetCameraLookAtMessage":
            self.look_at = tuple(message["look_at"])
        elif message["type"] == "RunJavascriptMessage":
            self.scripts.append(message["source"])
        elif "props" in message and "name" in message:
            self.drawn.add(message["name"])
            self._owners[message["name"]] = message["owner"]

    def until(self, what, why: str, seconds: float = 60.0) -> None:
        """Read until something holds; fail with ``why`` where it does not."""
        end = time.monotonic() + seconds
        while not what():
            assert time.monotonic() < end, why
            self.read(0.05)

    def _uuid(self, label: str) -> str:
        return next(uuid for uuid, props in self.controls.items() if props.get("label") == label)

    def value(self, label: str):
        return self.controls[self._uuid(label)]["value"]

    def visible(self, label: str) -> bool:
        return self.controls[self._uuid(label)]["visible"]

    def set(self, label: str, value) -> None:
        """Set a control, or press a button by True."""
        uuid = self._uuid(label)
        self.controls[uuid]["value"] = value
        self.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}})

    def button(self, label: str) -> bool:
        """Whether there is a control of this label now."""
        return any(props.get("label") == label for props in self.controls.values())

    def click(self, name: str, origin, direction) -> None:
        """Click a node of the scene along a ray."""
        ray = {"ray_origin": [*map(float, origin)], "ray_direction": [*map(float, direction)]}
        more = {"instance_index": None, "screen_pos": (0.5, 0.5), "modifier": None}
        owner = self._owners[name]
        self.send({"type": "SceneNodeClickMessage", "name": name, "owner": owner, **ray, **more})

    def drag(self, name: str, position, wxyz) -> None:
        """Drag a handle of the scene to a pose."""
        node = {"name": name, "owner": self._owners[name]}
        pose = {"position": [*map(float, position)], "wxyz": [*map(float, wxyz)]}
        self.send({"type": "TransformControlsDragStartMessage", **node})
        self.send({"type": "TransformControlsUpdateMessage", **node, **pose})
        self.send({"type": "TransformControlsDragEndMessage", **node})

    @property
    def said(self) -> str:
        """All that the page says, as HTML."""
        return "\n".join(
            p["content"] for p in self.controls.values() if isinstance(p.get("content"), str)
        )

    def zeta(self, target: str, column: int = -1) -> float | None:
        """What the table says of a target, percent; None before it does."""
        row = re.search(rf"<tr><td[^>]*>{re.escape(target)}</td>(.*?)</tr>", self.said)
        return float(re.findall(r"<td[^>]*>([\d.]+)</td>", row[1])[column]) if row else None

    @property
    def words(self) -> str:
        """All that the page says, as it is read."""
        return unescape(re.sub(r"<[^>]*>", " ", self.said))

    def close(self) -> None:
        self._socket.close()


@contextmanager
def pages_of(server):
    """Yield a function that opens a page of a viewer; all are closed at the end."""
    clients = []

    def opened(**how) -> Client:
        client = Client(server.url, **how)
        clients.append(client)
        client.until(lambda: client.zeta("V_S(0.5)") is not None, "the page says no ζ")
        return client

    yield opened
    for client in clients:
        client.close()
    until(lambda: server.pages == 0, "a closed page is still kept")
