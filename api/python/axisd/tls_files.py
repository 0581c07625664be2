"""The PEM files of a connection, looked at before gRPC gets them: with half a pair it ends the whole process, and with a
wrong file it only says that it could not connect."""
from __future__ import annotations

import os
import pathlib
from dataclasses import dataclass

import grpc

from .errors import ArgumentError

Path = str | os.PathLike[str]

_CERTIFICATE, _KEY = b"CERTIFICATE-----", b"PRIVATE KEY-----"


def _read(argument: str, path: Path, holds: bytes, what: str) -> bytes:
    try:
        content = pathlib.Path(path).read_bytes()
    except OSError as error:
        raise ArgumentError(f"{argument}: cannot read {str(path)!r}: {error.strerror}",
                            "give a PEM file that you may read") from None
    if holds not in content:
        raise ArgumentError(f"{argument}: there is no {what} in {str(path)!r}", f"give a PEM file with the {what}")
    return content


@dataclass(frozen=True)
class TlsFiles:
    """Names of files; without `ca` a connection has no TLS."""

    ca: Path | None = None
    certificate: Path | None = None
    key: Path | None = None

    @classmethod
    def given(cls, ca: Path | None, certificate: Path | None, key: Path | None) -> TlsFiles:
        """Those of the call, else $AXISD_TLS_CA, and as a pair $AXISD_TLS_CERT and $AXISD_TLS_KEY, as for axisctl."""
        def named(name: str) -> str | None:
            return os.environ.get(name) or None

        if certificate is None and key is None:
            certificate, key = named("AXISD_TLS_CERT"), named("AXISD_TLS_KEY")
        return cls(ca if ca is not None else named("AXISD_TLS_CA"), certificate, key)

    def credentials(self) -> grpc.ChannelCredentials | None:
        """None: without TLS. Blocks for the disk. Raises ArgumentError."""
        if self.ca is None and (self.certificate is not None or self.key is not None):
            raise ArgumentError("tls_certificate and tls_key need tls_ca",
                                "give the certificate that the daemon's is checked with")
        if (self.certificate is None) != (self.key is None):
            raise ArgumentError("tls_certificate and tls_key belong together", "give both")
        if self.ca is None:
            return None
        authority = _read("tls_ca", self.ca, _CERTIFICATE, "certificate")
        if self.certificate is None or self.key is None:
            return grpc.ssl_channel_credentials(authority)
        certificate = _read("tls_certificate", self.certificate, _CERTIFICATE, "certificate")
        key = _read("tls_key", self.key, _KEY, "private key")
        return grpc.ssl_channel_credentials(authority, key, certificate)
