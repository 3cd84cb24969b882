"""Files that a laboratory's machine has signed: who says so is checked before anything in them is read.

Beside ``sweep.mat`` lies ``sweep.mat.signed``, JSON::

    {"format": 1, "statement": "{...}", "signature": "(base64)"}

The statement is JSON text again, exactly as it was signed: the digest of the file, and what the machine knows of it.
Signatures are Ed25519's, by the package ``cryptography``, which only those need who sign or verify.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotflex.courseware.messages import _
from rotflex.errors import ConfigurationError, SignatureError

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

ENDING = ".signed"  #: of the name of what lies beside a signed file
FORMAT = 1
MOST_BYTES = 20_000  #: of what lies beside a file
_DIGEST = "sha256"  # in a statement


def request(student: str, content: bytes) -> bytes:
    """What is sent to a program that signs: who asks, and the file."""
    return json.dumps({"student": student, "bytes": len(content)}).encode() + b"\n" + content


@dataclass(frozen=True)
class Statement:
    """What a machine says of a file.

    Attributes
    ----------
    about : what it knows of the file, plain data
    key : the public key that it is signed with
    """

    about: Mapping[str, Any]
    key: str

    def text(self, name: str) -> str:
        """A text in it; "" if there is none of that name."""
        value = self.about.get(name, "")
        return value if isinstance(value, str) else ""


def digest(content: bytes) -> str:
    """By which a statement knows its file."""
    return hashlib.sha256(content).hexdigest()


def signed(content: bytes, about: Mapping[str, Any], key: Ed25519PrivateKey) -> bytes:
    """What is to lie beside a file.

    Parameters
    ----------
    content : of the file
    about : what is to be said of it, plain data
    key : from :func:`private_key`
    """
    statement = json.dumps({**about, _DIGEST: digest(content)}, sort_keys=True)
    signature = base64.b64encode(key.sign(statement.encode())).decode("ascii")
    return (json.dumps({"format": FORMAT, "statement": statement, "signature": signature}, indent=1) + "\n").encode()


def verified(content: bytes, beside: bytes, keys: Iterable[str]) -> Statement:
    """What a machine of the laboratory's says of a file. The file is not read for it.

    Parameters
    ----------
    content : of the file
    beside : what lies beside it
    keys : public keys of the laboratory's machines

    Raises
    ------
    SignatureError
        If it is not signed by one of them, or the file is another than was signed; the message says which.
    ConfigurationError
        If ``cryptography`` is not installed, or a key is none.
    """
    text, signature = _read(beside)
    key = next((key for key in keys if _is_by(key, text, signature)), None)
    if key is None:
        raise SignatureError(
            _("its signature is not one of the laboratory's: the statement was changed, or another key was used")
        )
    try:
        about = json.loads(text)
        said = about[_DIGEST]
    except (ValueError, TypeError, KeyError, RecursionError):
        raise SignatureError(_("what was signed says of no file")) from None
    if said != digest(content):
        raise SignatureError(_("the file was changed after it was signed, or the signature is another file's"))
    return Statement(about, key)


def _read(beside: bytes) -> tuple[str, bytes]:
    try:
        if len(beside) > MOST_BYTES:
            raise ValueError(len(beside))
        content = json.loads(beside)
        text, signature = content["statement"], base64.b64decode(content["signature"], validate=True)
        if content["format"] != FORMAT or not isinstance(text, str):
            raise ValueError(content["format"])
    except (ValueError, TypeError, KeyError, RecursionError, binascii.Error):
        raise SignatureError(_("what lies beside it is no signature that can be read")) from None
    return text, signature


def _is_by(key: str, text: str, signature: bytes) -> bool:
    public = public_key(key)
    from cryptography.exceptions import InvalidSignature

    try:
        public.verify(signature, text.encode(errors="surrogatepass"))
    except InvalidSignature:
        return False
    return True


# --- keys -------------------------------------------------------------------------------------------------------------


def new_key() -> tuple[bytes, str]:
    """A new private key, as its file holds it (PKCS 8, PEM), and its public key.

    Raises
    ------
    ConfigurationError
        If ``cryptography`` is not installed.
    """
    _require()
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    key = Ed25519PrivateKey.generate()
    private = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    return private, public_of(key)


def public_of(key: Ed25519PrivateKey) -> str:
    """The public key that goes with a private one, as settings have it: 44 characters."""
    return base64.b64encode(key.public_key().public_bytes_raw()).decode("ascii")


def private_key(file: Path) -> Ed25519PrivateKey:
    """The key in a file.

    Raises
    ------
    ConfigurationError
        If it cannot be read, or is no such key.
    """
    _require()
    from cryptography.hazmat.primitives import serialization
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    try:
        key = serialization.load_pem_private_key(file.read_bytes(), password=None)
    except OSError as error:
        raise ConfigurationError(
            _("The key {file} cannot be read: {why}.").format(file=file, why=error.strerror or error)
        ) from None
    except (ValueError, TypeError) as error:
        raise ConfigurationError(_("{file} holds no key: {why}").format(file=file, why=error)) from None
    if not isinstance(key, Ed25519PrivateKey):
        raise ConfigurationError(_("{file} holds a key, but none for Ed25519.").format(file=file))
    return key


def public_key(text: str) -> Ed25519PublicKey:
    """A public key, as settings have it.

    Raises
    ------
    ConfigurationError
        If it is none.
    """
    _require()
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    try:
        return Ed25519PublicKey.from_public_bytes(base64.b64decode(text, validate=True))
    except (ValueError, binascii.Error):
        raise ConfigurationError(
            _("{text!a:.60} is no public key: it should be the 44 characters that were printed with the key.").format(
                text=text
            )
        ) from None


def _require() -> None:
    try:
        import cryptography  # noqa: F401
    except ImportError:
        raise ConfigurationError(
            _("Signatures need the package cryptography: python -m pip install cryptography")
        ) from None
