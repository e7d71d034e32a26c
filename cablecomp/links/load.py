"""Reading a link file: its keys, and that no two devices of it share an identifier."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cablecomp.config import TomlTable, read_toml, validated
from cablecomp.errors import InputError
from cablecomp.examples import resolve
from cablecomp.links.devices import Claim
from cablecomp.links.protocols import claims_of
from cablecomp.links.schema import CanBus, LinkConfig, SerialBus
from cablecomp.links.schema_devices import DynamixelDevice, MoteusDevice


def _tuples(data: Any) -> Any:
    # TOML arrays arrive as lists; the strict models want tuples.
    if isinstance(data, dict):
        return {k: _tuples(v) for k, v in data.items()}
    return tuple(_tuples(v) for v in data) if isinstance(data, list) else data


def load_link(path: Path | str) -> LinkConfig:
    """Read a link file; raises InputError with one line that names file, key, what was found, what is
    accepted. A bare name such as `mit-udp` stands for an example that comes with the project."""
    path = resolve(path, "links")
    return parse_link(read_toml(path), str(path), path.parent)


def parse_link(data: dict[str, Any], where: str, folder: Path = Path()) -> LinkConfig:
    """Validate a link already read; `where` names it in errors, relative paths start at `folder`. Raises
    InputError with one line, also where two devices would share an identifier."""
    if "folder" in data:
        raise InputError(f"{where}: unknown key `folder`; remove it or check its spelling")
    lines = data.lines() if isinstance(data, TomlTable) else None
    config = validated(LinkConfig, {**_tuples(data), "folder": folder}, where, lines)
    _check_fd(config, where)
    _check_line(config, where)
    _check_identifiers(config, where)
    return config


def _check_fd(config: LinkConfig, where: str) -> None:
    """Raise InputError where a device needs CAN FD on a bus without it."""
    wanting = next((d for d in config.device if isinstance(d, MoteusDevice)), None)
    if wanting is not None and isinstance(config.bus, CanBus) and not config.bus.fd:
        raise InputError(
            f"{where}: device `{wanting.id}` speaks `{wanting.protocol}`, which needs CAN FD; set bus.fd = true, "
            "on an interface that can"
        )


def _check_line(config: LinkConfig, where: str) -> None:
    """Raise InputError where Dynamixel packets would go over a CAN bus, or share a line with something else."""
    packets = [isinstance(device, DynamixelDevice) for device in config.device]
    if any(packets) and not (all(packets) and isinstance(config.bus, SerialBus)):
        raise InputError(
            f'{where}: a `dynamixel` needs a line of its own: bus.kind = "serial", and no other protocol on it, is '
            "accepted"
        )


def _check_identifiers(config: LinkConfig, where: str) -> None:
    """Raise InputError where two devices would send or take frames of the same identifier."""
    seen: dict[int, list[tuple[str, Claim]]] = {}
    try:
        claims = tuple(claims_of(config))
    except InputError as error:  # a model or a message table that is not there
        raise InputError(f"{where}: {error}") from None
    for owner, claim in claims:
        for other, before in seen.setdefault(claim.identifier, []):
            if other != owner and not _may_share(claim, before):
                raise InputError(
                    f"{where}: identifier 0x{claim.identifier & 0x1FFF_FFFF:X} would be used by {other} "
                    f"({before.what}) and by {owner} ({claim.what}), which cannot be told apart; give one of "
                    "them another node, reply_id or message table"
                )
        seen[claim.identifier].append((owner, claim))


def _may_share(a: Claim, b: Claim) -> bool:
    by_number = a.mask != 0 and a.mask == b.mask and a.number != b.number
    return by_number or (a.group != "" and a.group == b.group)
