# SPDX-License-Identifier: BSD-3-Clause
"""Bytes between two sides, over Zenoh: QUIC with mutual TLS, nothing sent again.

Zenoh's threads are native ones; what comes waits in a ring of the newest until the
side's own thread takes it, so that a loop at 1 kHz needs no second Python thread.
"""

from __future__ import annotations

import contextlib
import errno
import ipaddress
import json
import socket
import sys
from pathlib import Path
from typing import Any

from dual_proxy.link import SIDES, LinkError
from dual_proxy.link.keys import SideKeys, check_keys, common_name
from dual_proxy.text import one_line

try:
    import zenoh
except ImportError as _error:
    raise ImportError(
        "the link between two processes needs Zenoh "
        f"(pip install 'drake-dual-proxy[hardware]'): {_error}",
        name="zenoh",
    ) from _error

__all__ = ["RING", "Transport"]

#: How many messages wait until they are taken; older ones are dropped.
RING = 16
# ms: a peer that says nothing for so long is gone.
_LEASE = 2000
# ms: between two attempts to connect, the first and the longest.
_RETRY = (100, 500)
# ms: for opening a connection, which takes four round trips. Closing waits for it.
_OPENING = 3000
# Bytes of the longest message that is taken.
_LONGEST = 4096


class Transport:
    """Sends bytes to the other side and takes what comes from it.

    One side listens, the other connects; either may start first, end and come back.
    Both need the keys that `dual-proxy keys` made for them. Without keys a transport is
    `insecure`: plain UDP between processes of one machine, and nothing else.

    Nothing here blocks once it is made, and nothing raises for what the network does.
    """

    def __init__(
        self,
        side: str,
        *,
        listen: str | None = None,
        connect: str | None = None,
        keys: Path | None = None,
        insecure: bool = False,
    ) -> None:
        """`side` is "robot" or "haptic"; `listen` or `connect` is HOST:PORT, the
        former of an address of this machine; `keys` is the side's folder.

        Raises LinkError.
        """
        if side not in SIDES:
            raise LinkError(f"side: expected one of {', '.join(SIDES)}, got {side!r}")
        if (listen is None) == (connect is None):
            raise LinkError(
                "expected an address to listen on or one to connect to, got "
                + ("neither" if listen is None else "both")
            )
        if insecure == (keys is not None):
            raise LinkError(
                "expected the folder of this side's keys (`dual-proxy keys` makes it), "
                "or --insecure for two processes on one machine; got "
                + ("both" if insecure else "neither")
            )
        self._side = side
        self._listens = listen is not None
        self._address = listen if listen is not None else str(connect)
        self._option = "--listen" if self._listens else "--connect"
        self._host, self._port = _split_address(self._option, self._address)
        self._keys: SideKeys | None = None
        if keys is not None:
            self._keys = check_keys(keys, side)
            if not self._listens and ":" in self._host:
                raise LinkError(
                    "--connect: Zenoh checks no certificate of an IPv6 address, got "
                    f"{self._host}; connect to a name for it, or to IPv4"
                )
        else:
            self._host = _loopback(self._option, self._host)
            print(
                f"dual-proxy: warning: insecure link on {self._host}: whoever has an "
                "account on this machine can command the robot",
                file=sys.stderr,
            )
        self._probe = None if self._listens else _open_probe(self._host, self._port)
        self._refused = False
        if self._listens:
            _check_free(self._address, self._host, self._port)
        ends = (side, _other(side))
        inbound, outbound = (f"dual_proxy/to_{name}" for name in ends)
        beside_in, beside_out = (f"dual_proxy/config/to_{name}" for name in ends)
        try:
            self._session: Any = zenoh.open(
                self._config([inbound, beside_in], [outbound, beside_out])
            )
            # What is beside the frames is there when they are.
            self._beside_in = self._subscribe(beside_in, 4)
            self._beside_out = self._publish(beside_out)
            self._inbound = self._subscribe(inbound, RING)
            self._outbound = self._publish(outbound)
        except zenoh.ZError as error:
            what = "listen on" if self._listens else "connect to"
            # Without the place in its source.
            reason = one_line(error).partition(" at /")[0]
            raise LinkError(f"cannot {what} {self._address}: {reason}") from None

    def __enter__(self) -> Transport:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def send(self, data: bytes) -> None:
        """Send, if there is somebody and nothing is jammed; else drop."""
        with contextlib.suppress(zenoh.ZError):  # It is closed.
            self._outbound.put(data)

    def receive(self) -> list[bytes]:
        """Take what has come since the last call, the newest RING of it, in order."""
        taken = []
        with contextlib.suppress(zenoh.ZError):  # It is closed.
            for _ in range(RING):
                sample = self._inbound.try_recv()
                if sample is None:
                    break
                taken.append(sample.payload.to_bytes())
        return taken

    def send_beside(self, data: bytes) -> None:
        """As `send`, of what is told beside the frames."""
        with contextlib.suppress(zenoh.ZError):  # It is closed.
            self._beside_out.put(data)

    def receive_beside(self) -> bytes | None:
        """Take the next of what was told beside the frames, if there is any."""
        with contextlib.suppress(zenoh.ZError):  # It is closed.
            sample = self._beside_in.try_recv()
            if sample is not None:
                return bytes(sample.payload.to_bytes())
        return None

    def peers(self) -> list[str]:
        """Return who is connected, as their certificates name them.

        One that was killed is listed for 2 s more.
        """
        return [
            link.auth_identifier or "without a certificate"
            for link in self._session.info.links()
        ]

    def why_alone(self) -> str:
        """Return likely reasons why nobody is connected, the likeliest first.

        Costs a system call or two; what it knows of the other machine it asked for in
        the call before.
        """
        other = _other(self._side)
        if not self._listens:
            self._ask()
        if self._refused:
            return (
                f"nothing takes UDP on port {self._port} there: the {other} side is "
                "not started or listens elsewhere, or a firewall rejects it"
            )
        reasons = [
            f"the {other} side is not started",
            f"it uses another port than {self._port}, or another host",
            f"a firewall drops UDP on port {self._port}",
        ]
        if self._keys is None:
            reasons.append("it is not started with --insecure")
            return "; ".join(reasons)
        trust = [
            "its keys were not made together with these (`dual-proxy keys`), or have "
            "expired, or its clock is wrong"
        ]
        if self._listens:
            hosts = ", ".join(self._keys.hosts)
            trust.append(f"it connects by a name that is not in these keys ({hosts})")
            return "; ".join(reasons + trust)
        # Something may well be there.
        trust.append(f"its keys do not name {self._host}")
        return "; ".join(trust + reasons)

    def is_same_side(self) -> bool:
        """Whether a peer is of this very side, which cannot be talked to."""
        peers = self.peers()
        if self._keys is not None:
            return common_name(self._side) in peers
        # It does not take what this side sends.
        return bool(peers) and not self._outbound.matching_status.matching

    def address_text(self) -> str:
        """Return where this side listens or connects to, for people."""
        what = "listening on" if self._listens else "connecting to"
        return f"{what} {self._address}"

    def close(self) -> None:
        """Close the connection; may be called again. Takes up to 3 s while nobody is
        there to connect to."""
        if self._probe is not None:
            self._probe.close()
            self._probe = None
        with contextlib.suppress(zenoh.ZError):
            self._session.close()

    def _subscribe(self, key: str, most: int) -> Any:
        return self._session.declare_subscriber(key, zenoh.handlers.RingChannel(most))

    def _publish(self, key: str) -> Any:
        return self._session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME,
            express=True,
            reliability=zenoh.Reliability.BEST_EFFORT,
            allowed_destination=zenoh.Locality.REMOTE,
        )

    def _ask(self) -> None:
        """Take the other machine's answer to the datagram of the last call, which of a
        port where nothing is comes back as an error, and send the next."""
        if self._probe is None:
            return
        answer = self._probe.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        self._refused = answer == errno.ECONNREFUSED
        with contextlib.suppress(OSError):
            self._probe.send(b"?")

    def _config(self, inbound: list[str], outbound: list[str]) -> Any:
        host = f"[{self._host}]" if ":" in self._host else self._host
        secure = self._keys is not None
        # Without streams in order (rel=0) what is late does not hold up what follows.
        endpoint = (
            f"quic/{host}:{self._port}?rel=0" if secure else f"udp/{host}:{self._port}"
        )
        settings: dict[str, Any] = {
            "mode": "peer",
            "listen": {
                "endpoints": [endpoint] if self._listens else [],
                "timeout_ms": 0,
                "exit_on_failure": True,
            },
            "connect": {
                "endpoints": [] if self._listens else [endpoint],
                "timeout_ms": -1,
                "exit_on_failure": False,
                "retry": {
                    "period_init_ms": _RETRY[0],
                    "period_max_ms": _RETRY[1],
                    "period_increase_factor": 2,
                },
            },
            "open/return_conditions": {"connect_scouted": False, "declares": False},
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
            "transport/shared_memory/enabled": False,
            "transport/unicast/open_timeout": _OPENING,
            "transport/unicast/accept_timeout": _OPENING,
            "transport/link/tx/lease": _LEASE,
            # us: a loop is not to wait for a jam.
            "transport/link/tx/queue/congestion_control/drop/wait_before_drop": 0,
            "transport/link/rx/max_message_size": _LONGEST,
            "transport/link/protocols": ["quic" if secure else "udp"],
        }
        if self._keys is not None:
            certificate, key = str(self._keys.certificate), str(self._keys.key)
            settings["transport/link/tls"] = {
                "root_ca_certificate": str(self._keys.ca),
                "listen_certificate": certificate,
                "listen_private_key": key,
                "connect_certificate": certificate,
                "connect_private_key": key,
                "enable_mtls": True,
                "verify_name_on_connect": True,
            }
            settings["access_control"] = _only_between(
                common_name(_other(self._side)), inbound, outbound
            )
        config = zenoh.Config()
        for name, value in settings.items():
            config.insert_json5(name, json.dumps(value))
        return config


def _other(side: str) -> str:
    return SIDES[1 - SIDES.index(side)]


def _only_between(peer: str, inbound: list[str], outbound: list[str]) -> dict[str, Any]:
    """Zenoh's rules: only the other side's certificate may send here or listen."""
    rules = [
        {
            "id": f"{message} {flow}",
            "permission": "allow",
            "messages": [message],
            "flows": [flow],
            "key_exprs": inbound if to_here else outbound,
        }
        for message, flow, to_here in (
            ("put", "ingress", True),
            ("put", "egress", False),
            ("declare_subscriber", "ingress", False),
            ("declare_subscriber", "egress", True),
        )
    ]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": "peer", "cert_common_names": [peer]}],
        "policies": [{"rules": [rule["id"] for rule in rules], "subjects": ["peer"]}],
    }


def _split_address(option: str, text: str) -> tuple[str, int]:
    """HOST:PORT, the host of IPv6 in brackets."""
    host, colon, port = text.rpartition(":")
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
    elif ":" in host:
        host = ""
    unusual = set(host) & set(" /?#,;@[]")
    if not (colon and host and not unusual and port.isascii() and port.isdigit()):
        raise LinkError(f"{option}: expected HOST:PORT, got {text!r}")
    if not 1 <= int(port) <= 65535:
        raise LinkError(f"{option}: expected a port in [1, 65535], got {port}")
    return host, int(port)


def _resolve(option: str, host: str, port: int) -> list[Any]:
    try:
        return socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
    except OSError as error:
        raise LinkError(f"{option}: {host}: {error.strerror or error}") from None


def _check_free(address: str, host: str, port: int) -> None:
    """Raise LinkError if nobody can listen there now, for a reason Zenoh buries."""
    family, kind, protocol, _, where = _resolve("--listen", host, port)[0]
    try:
        with socket.socket(family, kind, protocol) as tried:
            tried.bind(where)
    except OSError as error:
        why = {
            errno.EADDRINUSE: "the port is in use",
            errno.EADDRNOTAVAIL: "it is no address of this machine",
        }.get(error.errno or 0, error.strerror)
        raise LinkError(f"--listen: cannot listen on {address}: {why}") from None


def _open_probe(host: str, port: int) -> socket.socket | None:
    """A socket that notices if nothing is at a port; None where there is no way."""
    family, kind, protocol, _, address = _resolve("--connect", host, port)[0]
    probe = socket.socket(family, kind, protocol)
    try:
        probe.setblocking(False)
        probe.connect(address)
    except OSError:
        probe.close()
        return None
    return probe


def _loopback(option: str, host: str) -> str:
    """The address of a host, which must be this machine alone."""
    found = {str(entry[4][0]) for entry in _resolve(option, host, 0)}
    if not all(ipaddress.ip_address(address).is_loopback for address in found):
        raise LinkError(
            f"--insecure is for 127.0.0.1, ::1 and localhost alone, got {host}; "
            "between machines both sides need keys (`dual-proxy keys`)"
        )
    return "127.0.0.1" if "127.0.0.1" in found else min(found)
