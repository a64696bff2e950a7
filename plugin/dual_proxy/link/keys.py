# SPDX-License-Identifier: BSD-3-Clause
"""Keys of both sides: a certificate authority for two, and what is wrong with them.

A side's folder has `key.pem`, its secret, `certificate.pem`, which says which side it
is and under which names it is reached, and `ca.pem`, by which it knows the other's.
"""

from __future__ import annotations

import contextlib
import datetime
import ipaddress
import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from dual_proxy.link import SIDES, LinkError

try:
    from cryptography import x509
    from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
except ImportError as _error:
    raise ImportError(
        f"keys need cryptography (pip install 'drake-dual-proxy[hardware]'): {_error}",
        name="cryptography",
    ) from _error

__all__ = ["DAYS", "LOCAL_HOSTS", "SideKeys", "check_keys", "common_name", "make_keys"]

#: How long keys are valid.
DAYS = 365
#: Under which names a side is reached by a process of the same machine.
LOCAL_HOSTS = ("localhost", "127.0.0.1")
# A machine whose clock is late is to take them, too.
_LATE = datetime.timedelta(days=1)
# Either side may listen.
_EITHER_END = [ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH]


class SideKeys(NamedTuple):
    """Where a side's keys are, and what they say."""

    ca: Path
    certificate: Path
    key: Path
    hosts: tuple[str, ...]
    """The names in the certificate: by these the other side may connect to it."""
    valid_until: datetime.datetime


def common_name(side: str) -> str:
    """Return whom a side's certificate names."""
    return f"dual-proxy {side}"


def make_keys(
    folder: Path,
    robot_hosts: Sequence[str] = LOCAL_HOSTS,
    haptic_hosts: Sequence[str] = LOCAL_HOSTS,
    days: int = DAYS,
) -> datetime.datetime:
    """Make `folder` with the folders `robot` and `haptic`; return their last day.

    `..._hosts` are the names and IPv4 addresses under which that side's machine is
    reached. The authority's own key is not kept: nobody can sign a third certificate,
    and new ones are for both sides.

    Raises LinkError for a folder that is there and not empty, a host that is none,
    and fewer days than 1.
    """
    if not 1 <= days <= 36500:
        raise LinkError(f"days: expected an integer in [1, 36500], got {days}")
    names = {
        side: _alternative_names(hosts, f"{side} host")
        for side, hosts in zip(SIDES, (robot_hosts, haptic_hosts), strict=True)
    }
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise LinkError(
            f"{folder} is there already: expected a folder that is new or empty, as "
            "keys are never overwritten"
        )
    now = datetime.datetime.now(datetime.UTC)
    last = now + datetime.timedelta(days=days)
    authority_key = ec.generate_private_key(ec.SECP256R1())
    issuer = _name("dual-proxy authority")
    authority = (
        _builder(issuer, authority_key, now, last)
        .issuer_name(issuer)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_key_usage(signs_certificates=True), critical=True)
        .sign(authority_key, hashes.SHA256())
    )
    signed_by = x509.AuthorityKeyIdentifier.from_issuer_public_key(
        authority_key.public_key()
    )
    pem = serialization.Encoding.PEM
    files: dict[str, dict[str, bytes]] = {}
    for side, alternatives in names.items():
        key = ec.generate_private_key(ec.SECP256R1())
        certificate = (
            _builder(_name(common_name(side)), key, now, last)
            .issuer_name(issuer)
            .add_extension(signed_by, critical=False)
            .add_extension(x509.BasicConstraints(False, None), critical=True)
            .add_extension(_key_usage(signs_certificates=False), critical=True)
            .add_extension(x509.ExtendedKeyUsage(_EITHER_END), critical=False)
            .add_extension(x509.SubjectAlternativeName(alternatives), critical=False)
            .sign(authority_key, hashes.SHA256())
        )
        files[side] = {
            "ca.pem": authority.public_bytes(pem),
            "certificate.pem": certificate.public_bytes(pem),
            "key.pem": key.private_bytes(
                pem,
                serialization.PrivateFormat.PKCS8,
                serialization.NoEncryption(),
            ),
        }
    try:
        _make_folder(folder, files)
    except OSError as error:
        raise LinkError(f"{folder}: {error.strerror}") from None
    return last


def check_keys(folder: Path, side: str) -> SideKeys:
    """Return a side's keys, after looking for all that can be wrong with them here.

    Raises LinkError.
    """
    if not folder.is_dir():
        raise LinkError(
            f"keys: {folder} is no folder; `dual-proxy keys DIR` makes DIR/{side}"
        )
    if not (folder / "key.pem").exists() and (folder / side).is_dir():
        raise LinkError(
            f"keys: {folder} has the keys of both sides: the {side} side needs "
            f"{folder / side}"
        )
    ca_file, certificate_file, key_file = (
        folder / name for name in ("ca.pem", "certificate.pem", "key.pem")
    )
    ca = _load_certificate(ca_file)
    certificate = _load_certificate(certificate_file)
    secret = _read(key_file)
    mode = key_file.stat().st_mode & 0o777
    if mode & 0o077:
        raise LinkError(
            f"keys: {key_file} may be read by others (mode {mode:04o}, expected 0600); "
            f"chmod 600 {key_file}"
        )
    try:
        key = serialization.load_pem_private_key(secret, password=None)
    except (ValueError, TypeError, UnsupportedAlgorithm):
        raise LinkError(
            f"keys: {key_file} is no private key in PEM, or has a password"
        ) from None
    pem = serialization.Encoding.PEM
    form = serialization.PublicFormat.SubjectPublicKeyInfo
    if key.public_key().public_bytes(
        pem, form
    ) != certificate.public_key().public_bytes(pem, form):
        raise LinkError(
            f"keys: {key_file} is not the key of {certificate_file}; copy both from "
            "the same folder"
        )
    try:
        certificate.verify_directly_issued_by(ca)
    except (ValueError, TypeError, InvalidSignature):
        raise LinkError(
            f"keys: {certificate_file} was not signed by the authority of {ca_file}; "
            "both sides need keys of the same `dual-proxy keys`"
        ) from None
    for file, checked in ((ca_file, ca), (certificate_file, certificate)):
        _check_dates(file, checked)
    named = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    names = [str(attribute.value) for attribute in named]
    if names != [common_name(side)]:
        raise LinkError(
            f"keys: {certificate_file} is of {', '.join(names) or 'nobody'}, expected "
            f"{common_name(side)}: the {side} side needs the folder {side}"
        )
    return SideKeys(
        ca_file,
        certificate_file,
        key_file,
        _hosts(certificate),
        certificate.not_valid_after_utc,
    )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _alternative_names(hosts: Sequence[str], what: str) -> list[x509.GeneralName]:
    """Names and addresses, as a certificate has them."""
    names: list[x509.GeneralName] = []
    for host in hosts:
        # Zenoh checks no certificate of an IPv6 address.
        with contextlib.suppress(ValueError):
            names.append(x509.IPAddress(ipaddress.IPv4Address(host)))
            continue
        # A name whose last part is a number is an address that is wrong.
        last = host.removesuffix(".").rpartition(".")[2]
        unusual = set(host) & set(" /:*@[]")
        if not last or last.isdigit() or not host.isascii() or unusual:
            raise LinkError(f"{what}: expected a name or an IPv4 address, got {host!r}")
        names.append(x509.DNSName(host))
    if not names:
        raise LinkError(f"{what}: expected at least one name or IPv4 address")
    return names


def _key_usage(signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )


def _builder(
    subject: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    now: datetime.datetime,
    last: datetime.datetime,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _LATE)
        .not_valid_after(last)
        .add_extension(
            x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False
        )
    )


def _make_folder(folder: Path, files: Mapping[str, Mapping[str, bytes]]) -> None:
    """Make all of it or nothing, from the first byte on for its owner alone."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as scratch:
        draft = Path(scratch) / "keys"
        draft.mkdir(mode=0o700)
        for side, contents in files.items():
            (draft / side).mkdir(mode=0o700)
            for name, data in contents.items():
                flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
                descriptor = os.open(draft / side / name, flags, 0o600)
                with os.fdopen(descriptor, "wb") as stream:
                    stream.write(data)
        draft.rename(folder)


def _read(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise LinkError(f"keys: {file}: {error.strerror}") from None


def _load_certificate(file: Path) -> x509.Certificate:
    data = _read(file)
    try:
        return x509.load_pem_x509_certificate(data)
    except ValueError:
        raise LinkError(
            f"keys: {file} is no certificate in PEM, or is damaged"
        ) from None


def _check_dates(file: Path, certificate: x509.Certificate) -> None:
    now = datetime.datetime.now(datetime.UTC)
    first, last = certificate.not_valid_before_utc, certificate.not_valid_after_utc
    today = f"by this machine's clock it is {now:%Y-%m-%d %H:%M} UTC"
    if now > last:
        raise LinkError(
            f"keys: {file} has expired on {last:%Y-%m-%d %H:%M} UTC ({today}); "
            "`dual-proxy keys` makes new ones, for both sides"
        )
    if now < first:
        raise LinkError(
            f"keys: {file} is not valid before {first:%Y-%m-%d %H:%M} UTC ({today})"
        )


def _hosts(certificate: x509.Certificate) -> tuple[str, ...]:
    try:
        names = certificate.extensions.get_extension_for_class(
            x509.SubjectAlternativeName
        ).value
    except x509.ExtensionNotFound:
        return ()
    return tuple(str(name.value) for name in names)
