"""ROS 2 messages (CDR) of MCAP and SQLite files as objects, by the definition that the file holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Decoder = Callable[[bytes], Any]


def cdr_decoder(message_type: str, definition: str = "") -> Decoder:
    """Function that decodes the messages of one type.

    Args:
        message_type: with its package ("sensor_msgs/msg/Imu"; the "msg" may be missing).
        definition: text of the message's definition with those that it holds; "" for ROS 2's own messages, which
            files before Iron come without.

    Raises:
        Exception: of rosbags, for a definition that does not parse or a type that ROS 2 does not have.
    """
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    name = message_type if "/msg/" in message_type else message_type.replace("/", "/msg/", 1)
    if not definition:
        known = get_typestore(Stores.ROS2_HUMBLE)
        return lambda data: known.deserialize_cdr(data, name)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, name))
    return lambda data: store.deserialize_cdr(data, name)
