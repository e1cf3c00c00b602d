"""Messages of a Foxglove WebSocket server, such as ``foxglove_bridge`` of ROS or the Foxglove SDK.

Protocol: https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md. The server says in JSON which channels there
are. Messages of those that are subscribed to are binary frames: 01, subscription (uint32), time (uint64), payload.
"""

import base64
import binascii
import json
import queue
import struct
import threading
import time
from collections import Counter, deque
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from chladni.io.live.followed_log import Silence
from chladni.io.live.held_messages import joined_messages
from chladni.io.live.reception import MessageSource, Reception
from chladni.io.mcap.channel_registry import McapChannel, McapSchema
from chladni.signals.errors import LogError, SetupError
from chladni.signals.wording import counted

#: Names of the protocol, the SDK's first; servers choose the one they know.
PROTOCOLS: Final = ("foxglove.sdk.v1", "foxglove.websocket.v1")
#: Bytes of messages that wait to be analysed; what comes beyond is left out, and counted.
WAITING_BYTES: Final = 64 << 20
#: A larger frame is none of a sensor; the connection is closed.
LARGEST_FRAME_BYTES: Final = 64 << 20
#: Channels that a server may offer; MCAP numbers its own with 16 bits.
MOST_CHANNELS: Final = 1 << 16
#: A connection is tried again after so long, and after longer and longer.
AGAIN_S: Final = 0.2
LONGEST_AGAIN_S: Final = 5.0
CONNECT_S: Final = 10.0
_MESSAGE: Final = struct.Struct("<BIQ")
_MESSAGE_DATA: Final = 1
#: How the schema is encoded where the server doesn't say, by the encoding of the messages.
_SCHEMA_ENCODING: Final = {"protobuf": "protobuf", "json": "jsonschema", "ros1": "ros1msg", "cdr": "ros2msg"}
#: Schemas that aren't text come in base64.
_BINARY_SCHEMAS: Final = frozenset(["protobuf", "flatbuffer"])

Key = tuple[str, str, str, str, str]


class FoxgloveServer(MessageSource):
    """Messages of all channels of a server, as they come; a connection that is lost is made again.

    Parameters
    ----------
    address
        ``ws://HOST:PORT``.
    patience_s
        Seconds without a message after which the source counts as ended; None waits for ever.
    waiting_bytes
        Bytes of messages that may wait to be received.

    Raises
    ------
    LogError
        When nobody answers at the address, or no such server.
    SetupError
        When the package that speaks WebSocket isn't installed.
    """

    def __init__(self, address: str, *, patience_s: float | None = None, waiting_bytes: int = WAITING_BYTES) -> None:
        self.name = address
        self._patience_s = patience_s
        self._most = waiting_bytes
        self._silence = Silence(address, patience_s)
        self._lock = threading.Lock()
        self._ready = threading.Event()
        self._held: deque[tuple[int, int, bytes]] = deque()
        self._held_bytes = 0
        self._left_out: Counter[int] = Counter()
        self._told: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._channels: dict[int, McapChannel] = {}
        self._ids: dict[Key, int] = {}
        self._full = False
        self._sequence: Counter[int] = Counter()
        self._closed = threading.Event()
        self._connection = _connect(address)
        self._thread = threading.Thread(target=self._run, name="foxglove", daemon=True)
        self._thread.start()

    @property
    def channels(self) -> Mapping[int, McapChannel]:
        """Channels that the server has offered so far, by ids of ours."""
        with self._lock:
            return MappingProxyType(dict(self._channels))

    def receive(self, timeout_s: float) -> Reception:
        """Give what has come; see `MessageSource`."""
        self._ready.wait(timeout_s)
        with self._lock:
            held, self._held, self._held_bytes = self._held, deque(), 0
            left_out, self._left_out = self._left_out, Counter()
            self._ready.clear()
        told = [*self._silence.heard(bool(held)), *self._sentences(left_out)]
        while not self._told.empty():
            told.append(self._told.get())
        over = self._silence.over
        if over:
            told.append(f"{self.name}: nothing came for {self._patience_s:g} s")
        return Reception(batches=self._batches(held), told=tuple(told), ended=over)

    def close(self) -> None:
        """Close the connection."""
        self._closed.set()
        self._connection.close()
        self._thread.join(timeout=CONNECT_S)

    def _batches(self, held: "deque[tuple[int, int, bytes]]") -> tuple[Any, ...]:
        payloads: dict[int, tuple[list[bytes], list[int]]] = {}
        for channel, time_ns, payload in held:
            some, times = payloads.setdefault(channel, ([], []))
            some.append(payload)
            times.append(time_ns)
        batches = []
        for channel, (some, times) in payloads.items():
            batches.append(joined_messages(channel, some, times, sequence=self._sequence[channel]))
            self._sequence[channel] += len(some)
        return tuple(batches)

    def _sentences(self, left_out: "Counter[int]") -> list[str]:
        return [
            f"{self.name}: {counted(count, 'message')} of {self._channels[channel].topic} skipped: this computer "
            "can't follow; their places stay free"
            for channel, count in left_out.items()
        ]

    # --- the connection's thread ---

    def _run(self) -> None:
        lost_s: float | None = None
        while not self._closed.is_set():
            if lost_s is not None:
                self._told.put(
                    f"{self.name}: connected again after {time.monotonic() - lost_s:.1f} s; what was sent meanwhile "
                    "is missing"
                )
            why = self._listen()
            if self._closed.is_set():
                return
            lost_s = time.monotonic()
            self._told.put(f"{self.name}: the connection is lost ({why}); it is tried again")
            self._ready.set()
            if not self._connect_again():
                return

    def _connect_again(self) -> bool:
        wait_s = AGAIN_S
        while not self._closed.wait(wait_s):
            try:
                self._connection = _connect(self.name)
            except LogError:
                wait_s = min(2 * wait_s, LONGEST_AGAIN_S)
                continue
            if self._closed.is_set():
                self._connection.close()
            return not self._closed.is_set()
        return False

    def _listen(self) -> str:
        """Take frames until the connection ends; why it did."""
        from websockets.exceptions import ConnectionClosed

        subscribed: dict[int, int] = {}
        try:
            for frame in self._connection:
                if isinstance(frame, str):
                    self._text(frame, subscribed)
                elif len(frame) >= _MESSAGE.size and frame[0] == _MESSAGE_DATA:
                    _, subscription, time_ns = _MESSAGE.unpack_from(frame)
                    channel = subscribed.get(subscription)
                    if channel is not None and time_ns < 2**63:
                        self._hold(channel, time_ns, frame)
        except (ConnectionClosed, OSError, ValueError, TypeError, KeyError) as error:
            return " ".join(str(error).split()) or type(error).__name__
        return "the server closed it"

    def _hold(self, channel: int, time_ns: int, frame: bytes) -> None:
        with self._lock:
            if self._held_bytes > self._most:
                self._left_out[channel] += 1
                return
            payload = frame[_MESSAGE.size :]
            self._held.append((channel, time_ns, payload))
            self._held_bytes += len(payload)
        self._ready.set()

    def _text(self, frame: str, subscribed: dict[int, int]) -> None:
        said = json.loads(frame)
        if not isinstance(said, dict):
            raise TypeError("a message that is no object")
        if said.get("op") == "advertise":
            wanted = []
            for one in said["channels"]:
                channel = self._channel(one)
                if channel is None:
                    continue
                subscription = int(one["id"])
                if not 0 <= subscription < 2**32:
                    raise ValueError(f"channel id {subscription} is none")
                subscribed[subscription] = channel
                wanted.append({"id": subscription, "channelId": subscription})
            if wanted:
                self._connection.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        elif said.get("op") == "status" and said.get("level") == 2:
            self._told.put(f"{self.name}: the server says: {str(said.get('message'))[:200]}")

    def _channel(self, offered: Mapping[str, Any]) -> int | None:
        """Number of a channel that is offered; the same when it is offered again after a connection was lost."""
        encoding = str(offered["encoding"])
        schema_encoding = str(offered.get("schemaEncoding") or _SCHEMA_ENCODING.get(encoding, ""))
        key = (str(offered["topic"]), encoding, str(offered.get("schemaName", "")), schema_encoding,
               str(offered.get("schema", "")))  # fmt: skip
        with self._lock:
            if key in self._ids:
                return self._ids[key]
            if len(self._ids) >= MOST_CHANNELS:
                if not self._full:
                    self._told.put(f"{self.name}: offers more than {MOST_CHANNELS} channels; the others are left out")
                self._full = True
                return None
            number = len(self._ids) + 1
            try:
                self._channels[number] = _mcap_channel(number, key)
            except ValueError as error:
                self._told.put(f"{self.name}: the schema of {key[0]} can't be read: {error}")
                return None
            self._ids[key] = number
            return number


def _mcap_channel(number: int, key: Key) -> McapChannel:
    topic, encoding, schema_name, schema_encoding, text = key
    if schema_encoding in _BINARY_SCHEMAS:
        try:
            data = base64.b64decode(text, validate=True)
        except binascii.Error as error:
            raise ValueError(f"it is no base64 ({error})") from error
    else:
        data = text.encode()
    schema = None
    if schema_name or text:
        schema = McapSchema(id=number, name=schema_name, encoding=schema_encoding, data=data)
    return McapChannel(id=number, topic=topic, message_encoding=encoding, metadata={}, schema=schema)


def _connect(address: str) -> Any:
    try:
        from websockets.exceptions import InvalidHandshake, InvalidURI
        from websockets.sync.client import connect
        from websockets.typing import Subprotocol
    except ImportError as error:
        raise SetupError("a WebSocket server needs the extra [live]: pip install 'chladni[live]'") from error
    try:
        opened = connect(
            address,
            subprotocols=[Subprotocol(name) for name in PROTOCOLS],
            open_timeout=CONNECT_S,
            max_size=LARGEST_FRAME_BYTES,
            # Sensors' bytes hardly shrink, and inflating them takes the time of a core.
            compression=None,
            # A server on this computer or in this network isn't asked through a proxy.
            proxy=None,
        )
        # Of version 17 on, only so; the end of the connection is that of its `close`.
        return opened.__enter__()
    except InvalidURI as error:
        raise LogError(
            f"{address}: no address of a server; give ws://HOST:PORT, such as ws://127.0.0.1:8765"
        ) from error
    except (InvalidHandshake, OSError, TimeoutError) as error:
        why = (error.strerror if isinstance(error, OSError) else None) or str(error) or "no answer"
        raise LogError(
            f"{address}: no Foxglove server answers ({' '.join(why.split())}); start one, such as "
            "'ros2 launch foxglove_bridge foxglove_bridge_launch.xml', or name another address"
        ) from error
