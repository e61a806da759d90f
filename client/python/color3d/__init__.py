"""Client of Color3D: colours monochrome photos of a place and reconstructs it in 3D.

    import color3d
    with color3d.Client() as client:
        client.colorize("photos", "out", key_color="view003.png")
"""

from color3d.client import Client, KeyColor
from color3d.connection import Tls
from color3d.errors import (
    DamagedDataError,
    Error,
    InputError,
    JobFailedError,
    RpcError,
    UnreachableError,
)

__all__ = [
    "Client",
    "DamagedDataError",
    "Error",
    "InputError",
    "JobFailedError",
    "KeyColor",
    "RpcError",
    "Tls",
    "UnreachableError",
]
