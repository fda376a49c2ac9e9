"""Who reaches the viewer: only its own page, by the whole printed address, in bounded memory."""

import socket
import subprocess
import sys
from contextlib import ExitStack, closing, contextmanager, suppress
from http.client import HTTPConnection
from urllib.parse import urlsplit

import msgspec
import pytest
import viser
from hypothesis import given
from hypothesis import strategies as st
from place_rings._views import View
from place_rings.coverage.rings.ring import Ring, Setup
from place_rings.objectives.scene import Scene
from place_rings.viewer.connection_guard import acceptable
from place_rings.viewer.server import Server, own
from place_rings.viewer.session import ViewerSession
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from ..support.browser import until
from ..support.viser_client import CAMERA, Client

SETUP = Setup((Ring("forearm", 0.4, 5),))


@pytest.fixture(scope="module")
def served():
    with Server(ViewerSession(Scene.paper(), {"small": SETUP})) as server:
        yield server


def token(server) -> str:
    return urlsplit(server.url).path


def status(server, path: str, headers: dict[str, str] | None = None) -> tuple[int, dict[str, str]]:
    """Status and headers of the answer to a request by hand."""
    with closing(HTTPConnection("127.0.0.1", server.port, timeout=30)) as connection:
        connection.putrequest("GET", path, skip_host=True)
        for name, value in {"Host": f"127.0.0.1:{server.port}", **(headers or {})}.items():
            connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, {k.lower(): v for k, v in answer.getheaders()}


@contextmanager
def websocket(server, path: str, host: str | None = None, origin: str | None = None):
    """A websocket by hand."""
    host = host or f"127.0.0.1:{server.port}"
    with connect(
        f"ws://{host}{path}",
        sock=socket.create_connection(("127.0.0.1", server.port)),
        subprotocols=[f"viser-v{viser.__version__}"],
        origin=origin,
        compression=None,
        max_size=None,
    ) as found:
        yield found


LOCAL = ("127.0.0.1", "127.8.9.1", "localhost", "[::1]", "LocalHost")
names = st.from_regex(r"[a-z]([a-z0-9-]{0,10}[a-z0-9])?(\.[a-z]{2,6}){1,2}\.?", fullmatch=True)
addresses = st.one_of(
    st.ip_addresses(v=4).map(str), st.ip_addresses(v=6).map(lambda a: f"[{a}]")
).filter(lambda a: not (a.startswith("127.") or a == "[::1]"))
disguised = st.sampled_from(
    [
        *("127.0.0.1.", "localhost.", "127.1", "2130706433", "0x7f.0.0.1", "::1", "[::1", ""),
        *("evil.example@127.0.0.1", "127.0.0.1@evil.example", "127.0.0.1.evil.example"),
        *("localhost.evil.example", "127.0.0.1/evil", "127.0.0.1?x", "127.0.0.1#x", " 127.0.0.1"),
        *("127.0.0.1, evil.example", "[::ffff:127.0.0.1]", "localhost\t", "127.0.0.1:8:8"),
    ]
)
ports = st.one_of(st.just(""), st.integers(0, 65535).map(lambda p: f":{p}"))


@given(st.one_of(names, addresses, disguised), ports)
def test_a_foreign_host_is_refused(host, port):
    assert not own([host + port], [], "127.0.0.1")
    assert not own([host + port], [f"http://{host}{port}"], "localhost")


@given(st.sampled_from(LOCAL), ports, st.sampled_from(["http", "https", "HTTP"]))
def test_the_own_page_is_served_whatever_port_leads_to_it(host, port, scheme):
    assert own([host + port], [], "127.0.0.1")
    assert own([host + port], [f"{scheme}://{host}{port}"], "::1")


@given(
    st.sampled_from(LOCAL),
    st.one_of(names, addresses, disguised, st.sampled_from(LOCAL)),
    ports,
    st.sampled_from(["http://", "https://", "file://", "chrome-extension://", "", "//"]),
)
def test_a_foreign_origin_is_refused(host, origin, port, scheme):
    mine = origin.lower() == host.lower() and port == ":80" and scheme in ("http://", "https://")
    assert own([f"{host}:80"], [f"{scheme}{origin}{port}"], "127.0.0.1") is mine
    assert not own([f"{host}:80"], [f"http://{host}:80", f"{scheme}{origin}{port}"], "127.0.0.1")


@given(addresses, ports)
def test_a_server_for_others_answers_to_its_numbers_and_its_name(address, port):
    for wide in ("0.0.0.0", "::", "", "arm.lab", "192.0.2.7"):
        assert own([address + port], [f"http://{address}{port}"], wide)
    assert own([f"Arm.Lab{port}"], [f"http://arm.lab{port}"], "arm.lab")
    assert not own([f"arm.lab{port}"], [], "0.0.0.0")


@pytest.mark.parametrize("hosts", [[], ["127.0.0.1", "127.0.0.1"], ["127.0.0.1", "evil.example"]])
def test_one_host_only(hosts):
    assert not own(hosts, [], "127.0.0.1")


# https://github.com/viser-project/viser: no hook for Host, Origin or a password
FOREIGN = (
    {"Host": "evil.example"},
    {"Host": "127.0.0.1.evil.example:80"},
    {"Host": "10.1.2.3:80"},
    {"Origin": "http://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://127.0.0.1:1"},
)


@pytest.mark.parametrize("headers", FOREIGN)
def test_a_foreign_request_is_403_even_with_the_token(served, headers):
    assert status(served, token(served) + "/", headers)[0] == 403
    with (
        pytest.raises(InvalidStatus) as refused,
        websocket(served, token(served), headers.get("Host"), headers.get("Origin")),
    ):
        pass
    assert refused.value.response.status_code == 403


@pytest.mark.parametrize(
    "path", ["/", "", "/?token=", "/x", "/%2e%2e/index.html", "//", "/TOKEN/../", "/index.html"]
)
def test_without_the_token_all_is_403(served, path):
    wrong = token(served)[:-1] + ("a" if token(served)[-1] != "a" else "b")
    for begin in ("", wrong, token(served) + "x", token(served)[:-1]):
        assert status(served, (begin + path) or "/")[0] == 403
        with pytest.raises(InvalidStatus) as refused, websocket(served, (begin + path) or "/"):
            pass
        assert refused.value.response.status_code == 403


def test_with_the_token_the_page_is_served_and_no_file_beside_it(served):
    for path, wanted in (
        *(("", 200), ("/", 200), ("?view=Top", 200), ("/?view=Top", 200), ("/index.html", 200)),
        *(("/x", 404), ("/../../../etc/passwd", 404), ("/%2e%2e/%2e%2e/__init__.py", 404)),
    ):
        found, headers = status(served, token(served) + path)
        assert found == wanted
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
        assert headers["x-frame-options"] == "DENY"
        assert headers["cache-control"] == "no-store"
    assert status(served, "/")[1]["x-frame-options"] == "DENY"


def test_a_request_that_does_not_end_is_cut_and_an_old_one_gives_way(served):
    address = ("127.0.0.1", served.port)
    with closing(socket.create_connection(address, timeout=30)) as long, suppress(OSError):
        long.sendall(b"GET / HTTP/1.1\r\n" + 6 * (b"X: %s\r\n" % (8000 * b"x")))
        assert long.recv(1) == b""
    first = socket.create_connection(address, timeout=30)
    with closing(first), ExitStack() as stack:
        for _ in range(40):
            stack.enter_context(closing(socket.create_connection(address, timeout=30)))
        with suppress(ConnectionError):
            assert first.recv(1) == b""
        assert status(served, token(served))[0] == 200


def test_a_token_is_new_for_each_server_and_part_of_what_a_notebook_shows(served):
    with Server(ViewerSession(Scene.paper(), {"small": SETUP})) as other:
        view = View(other)
        assert token(other) != token(served)
        assert len(token(other)) > 20
        assert view.url == other.url
        assert other.url in view._repr_html_()


def message(kind: str, **fields) -> bytes:
    return msgspec.msgpack.encode({"type": kind, **fields})


update = st.builds(
    lambda value: message("GuiUpdateMessage", uuid="a", updates={"value": value}),
    st.one_of(st.text(max_size=50), st.floats(), st.booleans(), st.lists(st.floats(), max_size=3)),
)
REFUSED = (
    message("ShareUrlRequest"),
    message("ShareUrlDisconnect"),
    message("GuiFormDirtyMessage", uuid="a"),
    message("RunJavascriptMessage", source="alert(1)"),
    message("FileTransferStartUpload", source_component_uuid="a", transfer_uuid="b"),
    message("NoSuchMessage"),
    message("GuiUpdateMessage", uuid="a", updates={"update_cb": []}),
    message("GuiUpdateMessage", uuid="a", updates={"value": 1, "visible": False}),
    message("GuiUpdateMessage", uuid="a", updates={"value": "x" * 40_000}),
    message("GuiUpdateMessage", uuid="a"),
    message("GuiUpdateMessage", uuid=["a"], updates={}),
    msgspec.msgpack.encode({**CAMERA, "position": (1.0, 2.0)}),
    msgspec.msgpack.encode({**CAMERA, "fov": "wide"}),
    msgspec.msgpack.encode([CAMERA]),
    b"\x91" * 10_000,
    b"",
    "text",
)


@given(update)
def test_a_page_may_set_values(data):
    assert acceptable(data)


@pytest.mark.parametrize("data", REFUSED, ids=range(len(REFUSED)))
def test_a_page_may_send_nothing_else(data):
    assert not acceptable(data)


@given(st.one_of(st.binary(max_size=200), st.recursive(
    st.one_of(st.none(), st.integers(-9, 9), st.text(max_size=9)),
    lambda inner: st.dictionaries(st.text(max_size=5), inner, max_size=4),
).map(msgspec.msgpack.encode)))  # fmt: skip
def test_any_bytes_can_be_judged(data):
    assert acceptable(data) in (True, False)


def test_a_camera_and_a_large_picture_are_messages():
    assert acceptable(msgspec.msgpack.encode(CAMERA))
    assert acceptable(message("GetRenderResponseMessage", payload=b"x" * 10**6, render_uuid="a"))


def memory_mb() -> float:
    """Resident memory of this process, the server's thread among it."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096 / 1e6


# Attacks another process: whatever it keeps in memory is not the server's.
ATTACK = """
import contextlib, socket, sys
import msgspec, viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
port, token = int(sys.argv[1]), sys.argv[2]
slow = []
for i in range(1000):  # requests that never end
    slow.append(socket.create_connection(("127.0.0.1", port), timeout=30))
    with contextlib.suppress(OSError):  # it had to give way
        slow[-1].sendall(b"GET / HTTP/1.1\\r\\n" + b"X: %s\\r\\n" % (b"x" * 8000) * (i % 100))
def page(path):
    return connect(
        f"ws://127.0.0.1:{port}{path}", subprotocols=[f"viser-v{viser.__version__}"],
        compression=None, max_size=None,
    )
def update(value):
    return msgspec.msgpack.encode(
        {"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": value}}
    )
large = update("x" * 20_000_000)
for path in (*(["/"] * 20), *([token] * 20)):
    with contextlib.suppress(OSError, InvalidStatus, ConnectionClosed), page(path) as one:
        one.send(large)
        with contextlib.suppress(TimeoutError):
            one.recv(timeout=0.2)
with page(token) as one:
    for i in range(600):
        one.send(update(i))
    print("flooded", flush=True)
    sys.stdin.read()
"""


@pytest.mark.slow
def test_floods_and_slow_connections_take_no_memory_from_the_open_page():
    with Server(ViewerSession(Scene.paper(), {"small": SETUP})) as server:
        page = Client(server.url)
        page.until(lambda: page.zeta("V_S(0.5)") is not None, "the page says no ζ")
        page.set("Sensors", 9)
        page.until(lambda: "9 sensors" in page.words, "the edit does not come")
        before = memory_mb()
        command = [sys.executable, "-c", ATTACK, str(server.port), token(server)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as attack:
            assert attack.stdout is not None
            assert attack.stdout.readline() == b"flooded\n"
            assert status(server, token(server))[0] == 200
            assert page.value("Sensors") == 9
            page.set("Sensors", 11)
            page.until(lambda: "11 sensors" in page.words, "the page waits for a flood")
            assert memory_mb() - before < 100
            attack.kill()
        page.close()
        until(lambda: server.pages == 0, "a closed page is still kept")
