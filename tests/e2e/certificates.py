"""Certificates for loopback connections, by openssl."""
import pathlib
import subprocess


def openssl(*words):
    done = subprocess.run(["openssl", *words], capture_output=True, check=False, text=True)
    if done.returncode != 0:
        raise AssertionError(done.stderr)


class Certificates:
    """A certificate authority in a directory."""

    def __init__(self, directory, name):
        self.directory, self.name = pathlib.Path(directory), name
        openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                "-subj", f"/CN={name}", "-keyout", self.path("key"), "-out", self.path("crt"))

    def path(self, suffix, name=None):
        return str(self.directory / f"{name or self.name}.{suffix}")

    def issue(self, name, days=2):
        """Signs a certificate for the loopback address; `days`: until its end, which may be over."""
        request, extensions = self.path("csr", name), self.directory / f"{name}.ext"
        extensions.write_text("subjectAltName=DNS:localhost,IP:127.0.0.1\n")
        openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-subj", f"/CN={name}",
                "-keyout", self.path("key", name), "-out", request)
        openssl("x509", "-req", "-in", request, "-CA", self.path("crt"), "-CAkey", self.path("key"), "-CAcreateserial",
                "-days", str(days), "-extfile", str(extensions), "-out", self.path("crt", name))

    def revoke_nothing(self):
        """Writes its revocation list, which names nobody."""
        settings = self.directory / f"{self.name}.cnf"
        settings.write_text(f"[ca]\ndefault_ca = own\n[own]\ndatabase = {self.path('index')}\ndefault_md = sha256\n")
        pathlib.Path(self.path("index")).touch()
        openssl("ca", "-config", str(settings), "-cert", self.path("crt"), "-keyfile", self.path("key"), "-gencrl",
                "-crldays", "2", "-out", self.path("crl"))

    def read(self, suffix, name=None):
        return pathlib.Path(self.path(suffix, name)).read_bytes()
