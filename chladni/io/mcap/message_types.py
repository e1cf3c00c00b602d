"""The message type for a topic's fields: a ROS 2 type that has them all, else one made for them."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import nan

from chladni.io.mcap.cdr_layout import CdrLayout, cdr_layout
from chladni.io.mcap.ros2_definitions import DEFINITIONS, leaf_paths, schema_name, schema_text
from chladni.signals.errors import SetupError

KNOWN_TYPES = (
    "chladni_msgs/ScalarStamped",
    "sensor_msgs/Imu",
    "geometry_msgs/AccelStamped",
    "geometry_msgs/TwistStamped",
    "geometry_msgs/WrenchStamped",
    "geometry_msgs/Vector3Stamped",
)
"""Types that are tried in this order."""

# Every message holds the whole array, measured or not.
MAX_ELEMENTS = 4096
"""Longest array that is made up to hold a field with an index."""

_JOINT_FIELD = re.compile(r"^(position|velocity|effort)\[(\w+)\]$")
_PART = re.compile(r"^(?P<name>\w+)(?:\[(?P<index>\w+)\])?$")
_IMU_PARTS = ("orientation", "angular_velocity", "linear_acceleration")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MessageType:
    """How messages of a topic are encoded.

    Attributes
    ----------
    name, text
        Name and definition of the MCAP schema.
    layout
        Template with not-a-number wherever nothing was measured.
    paths
        Path in the layout of each field asked for; differs from it for the joints of a JointState.
    """

    name: str
    text: str
    layout: CdrLayout
    paths: Mapping[str, str]


def message_type(topic: str, fields: Sequence[str]) -> MessageType:
    """Choose the message type that holds `fields`, paths as in ``accel.linear.z`` or ``position[0]``.

    Raises
    ------
    SetupError
        When no message can hold them together, such as ``a`` and ``a.b``.

    Examples
    --------
    >>> message_type("/shaker", ["wrench.force.z"]).name
    'geometry_msgs/msg/WrenchStamped'
    >>> message_type("/axis", ["position[0]"]).name
    'sensor_msgs/msg/JointState'
    >>> print(message_type("/tank", ["pressure", "level[1]"]).text.splitlines()[1:3])
    ['float64 pressure', 'float64[2] level']
    """
    for type_name in KNOWN_TYPES:
        if set(fields) <= set(leaf_paths(type_name)):
            layout = cdr_layout(type_name, defaults=_defaults(type_name, fields))
            return _message_type(type_name, DEFINITIONS, layout, {path: path for path in fields})
    if all(_JOINT_FIELD.match(path) for path in fields):
        return _joint_state(topic, fields)
    return _made_type(topic, fields)


def _message_type(
    type_name: str, definitions: Mapping[str, str], layout: CdrLayout, paths: Mapping[str, str]
) -> MessageType:
    return MessageType(
        name=schema_name(type_name), text=schema_text(type_name, definitions), layout=layout, paths=paths
    )


def _defaults(type_name: str, fields: Sequence[str]) -> dict[str, float]:
    if type_name != "sensor_msgs/Imu":
        return dict.fromkeys(leaf_paths(type_name), nan)
    defaults = {path: 0.0 if "covariance" in path else nan for path in leaf_paths(type_name)}
    # Imu says "not measured" with -1 in front of the covariance; a viewer that draws the orientation regardless
    # should find a rotation there, not NaN.
    for part in _IMU_PARTS:
        if not any(path.startswith(f"{part}.") for path in fields):
            defaults[f"{part}_covariance[0]"] = -1.0
    if defaults["orientation_covariance[0]"] < 0:
        defaults |= {"orientation.x": 0.0, "orientation.y": 0.0, "orientation.z": 0.0, "orientation.w": 1.0}
    return defaults


def _joint_state(topic: str, fields: Sequence[str]) -> MessageType:
    matches = [_JOINT_FIELD.match(path) for path in fields]
    pairs = [(match[1], match[2]) for match in matches if match is not None]
    # Joints are named where the channels name them; numbered ones need names too, which viewers show.
    keys = list(dict.fromkeys(key for _, key in pairs))
    if any(key.isdigit() for key in keys):
        count = _count(topic, keys)
        joints = tuple(f"joint_{index}" for index in range(count))
        indices = {key: int(key) for key in keys}
    else:
        joints = tuple(keys)
        indices = {key: index for index, key in enumerate(keys)}
    lengths = {quantity: len(joints) for quantity, _ in pairs}
    defaults = {f"{quantity}[{index}]": nan for quantity in lengths for index in range(len(joints))}
    layout = cdr_layout("sensor_msgs/JointState", defaults=defaults, texts={"name": joints}, lengths=lengths)
    paths = {f"{quantity}[{key}]": f"{quantity}[{indices[key]}]" for quantity, key in pairs}
    return _message_type("sensor_msgs/JointState", DEFINITIONS, layout, paths)


def _count(topic: str, keys: Sequence[str]) -> int:
    if not all(key.isdecimal() and key.isascii() and str(int(key)) == key for key in keys):
        raise SetupError(
            f"{topic}: elements {', '.join(keys)} can't share an array; index all of them by number or all by name"
        )
    count = 1 + max(int(key) for key in keys)
    if count > MAX_ELEMENTS:
        raise SetupError(f"{topic}: index {count - 1} is above {MAX_ELEMENTS - 1}, the longest array written")
    return count


@dataclass(slots=True, kw_only=True)
class _Node:
    """A field of a type in the making: the indices it's used with, and its own fields."""

    keys: dict[str, None] = field(default_factory=dict)
    bare: bool = False
    leaf: bool = False
    members: dict[str, "_Node"] = field(default_factory=dict)


def _made_type(topic: str, fields: Sequence[str]) -> MessageType:
    root = _Node()
    for path in fields:
        _add_path(root, path)
    if "header" in root.members:
        raise SetupError(f"{topic}: field 'header' is taken by the stamp of the message; rename the channel")
    type_name = f"chladni_msgs/{_camel(topic) or 'Log'}"
    definitions = dict(DEFINITIONS)
    _define(topic, type_name, root, definitions)
    definitions[type_name] = f"std_msgs/Header header\n{definitions[type_name]}"
    defaults = dict.fromkeys(leaf_paths(type_name, definitions), nan)
    layout = cdr_layout(type_name, definitions=definitions, defaults=defaults)
    return _message_type(type_name, definitions, layout, {path: path for path in fields})


def _add_path(root: _Node, path: str) -> None:
    node = root
    for part in path.split("."):
        match = _PART.match(part)
        if match is None:
            raise AssertionError(f"no field path: {path!r}")
        node = node.members.setdefault(match["name"], _Node())
        if match["index"] is None:
            node.bare = True
        else:
            node.keys[match["index"]] = None
    node.leaf = True


def _define(topic: str, type_name: str, node: _Node, definitions: dict[str, str]) -> None:
    lines = []
    for name, member in node.members.items():
        if (member.bare and member.keys) or (member.leaf and member.members):
            raise SetupError(f"{topic}: field {name!r} can't be a number and hold others too; rename one of them")
        array = f"[{_count(topic, list(member.keys))}]" if member.keys else ""
        if member.leaf:
            lines.append(f"float64{array} {name}")
        else:
            inner = type_name + _camel(name)
            _define(topic, inner, member, definitions)
            lines.append(f"{inner}{array} {name}")
    definitions[type_name] = "\n".join(lines)


def _camel(text: str) -> str:
    words = re.findall(r"[A-Za-z0-9]+", text)
    joined = "".join(word[0].upper() + word[1:] for word in words)
    return joined if not joined[:1].isdigit() else f"T{joined}"
