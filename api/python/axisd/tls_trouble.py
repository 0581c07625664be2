"""Why there is no connection, where it is the certificates: gRPC says no more than that it could not connect."""
from __future__ import annotations

import datetime
import socket
import ssl
import time
from typing import Any

from .tls_files import Path, TlsFiles

_PATIENCE = 1.0
# Of OpenSSL; ssl has no name for the first.
_NO_CHECK_TIME = 0x200000
_LENIENT = _NO_CHECK_TIME | ssl.VERIFY_X509_PARTIAL_CHAIN
_UNKNOWN_AUTHORITY = (7, 18, 19, 20, 21)
_OTHER_HOST = (62, 64)


def _out_of_time(certificate: dict[str, Any]) -> tuple[bool, str] | None:
    """Why a certificate is not valid now, and whether it has ended, else has not begun; None: it is."""
    def text(at: float) -> str:
        return datetime.datetime.fromtimestamp(at, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")

    begin, end = (ssl.cert_time_to_seconds(certificate[key]) for key in ("notBefore", "notAfter"))
    if end < time.time():
        return True, f"has expired ({text(end)})"
    return (False, f"is not valid before {text(begin)}") if begin > time.time() else None


def _decoded(certificate: Path, key: Path) -> dict[str, Any]:
    """What stands in a certificate of one's own: ssl only tells that of a peer, so it is shown to itself."""
    server = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    server.load_cert_chain(certificate, key)
    server.verify_mode = ssl.CERT_REQUIRED
    server.load_verify_locations(certificate)
    server.verify_flags |= _LENIENT
    client = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client.check_hostname = False
    client.verify_mode = ssl.CERT_NONE
    client.load_cert_chain(certificate, key)
    there, back = ssl.MemoryBIO(), ssl.MemoryBIO()
    ends = [client.wrap_bio(back, there), server.wrap_bio(there, back, server_side=True)]
    for _ in range(4):
        for end in ends:
            try:
                end.do_handshake()
            except ssl.SSLWantReadError:
                pass
    return ends[1].getpeercert() or {}


def _own(certificate: Path, key: Path) -> str | None:
    try:
        wrong = _out_of_time(_decoded(certificate, key))
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            return ("tls_key: the key does not belong to the certificate of tls_certificate; "
                    "give the pair that was made together")
        return None
    except (OSError, KeyError, ValueError):
        return None
    if wrong is None:
        return None
    ended, text = wrong
    return (f"tls_certificate: the certificate {text}; "
            + ("renew it" if ended else "set the clock of this computer, or give another one"))


def _names(shown: dict[str, Any]) -> str:
    names = [value for kind, value in shown.get("subjectAltName", ()) if kind in ("DNS", "IP Address")]
    common = [value for part in shown.get("subject", ()) for key, value in part if key == "commonName"]
    return ", ".join(names or common)


def _shake_hands(address: tuple[str, int], context: ssl.SSLContext) -> tuple[dict[str, Any], bool]:
    """What the daemon shows, and whether it takes what is shown to it."""
    with socket.create_connection(address, timeout=_PATIENCE) as raw:
        with context.wrap_socket(raw, server_hostname=address[0]) as connection:
            shown = connection.getpeercert() or {}
            try:
                return shown, connection.recv(1) != b""  # a gRPC server speaks first
            except TimeoutError:
                return shown, True
            except OSError:
                return shown, False


def _daemon(address: tuple[str, int], tls_ca: Path, certificate: Path | None, key: Path | None) -> str | None:
    context = ssl.create_default_context(cafile=tls_ca)
    context.set_alpn_protocols(["h2"])
    context.check_hostname = False
    context.verify_flags |= _LENIENT
    if certificate is not None:
        context.load_cert_chain(certificate, key)
    shown, taken = _shake_hands(address, context)
    if wrong := _out_of_time(shown):
        ended, text = wrong
        return f"the daemon's certificate {text}; " + ("renew it there" if ended else "compare the clocks of both computers")
    context.check_hostname = True
    try:
        _shake_hands(address, context)
    except ssl.SSLCertVerificationError as error:
        if error.verify_code in _OTHER_HOST:
            return (f"the daemon's certificate is for {_names(shown)}, you called {address[0]}; "
                    f"call it by a name of its certificate, or give it one for {address[0]}")
        raise
    if taken:
        return None
    if certificate is None:
        return "the daemon asks for a certificate of the client; give tls_certificate and tls_key"
    return "the daemon does not take the certificate of tls_certificate; give one of an authority that it trusts"


def _without_tls(address: tuple[str, int]) -> str | None:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE  # nothing is said to it
    try:
        _shake_hands(address, context)
    except ssl.SSLError as error:
        if "ALERT" not in (error.reason or ""):  # that is TLS, too: it wants a certificate, say
            return None
    return "the daemon speaks TLS; give tls_ca, tls_certificate and tls_key"


def why(server: str, tls: TlsFiles) -> str | None:
    """What is wrong with the certificates of either side, in a line; None: nothing that is seen. Connects to see what
    the daemon shows: waits for some seconds at most."""
    host, _, port = server.rpartition(":")
    if tls.certificate is not None and tls.key is not None and (own := _own(tls.certificate, tls.key)):
        return own
    if server.startswith("unix:") or not port.isdecimal():
        return None
    address = (host.strip("[]"), int(port))
    try:
        return _without_tls(address) if tls.ca is None else _daemon(address, tls.ca, tls.certificate, tls.key)
    except ssl.SSLCertVerificationError as error:
        if error.verify_code in _UNKNOWN_AUTHORITY:
            return "the daemon's certificate is not signed by an authority of tls_ca; give that of this machine"
        return f"the daemon's certificate is not accepted: {error.verify_message}"
    except ssl.SSLError as error:
        if error.reason == "WRONG_VERSION_NUMBER":
            return "the daemon speaks no TLS at that address; leave out tls_ca, or call its address for TLS"
        return None
    except (OSError, KeyError, ValueError):
        return None  # nobody is there
