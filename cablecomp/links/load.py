"""Reading a link file: its keys, and that no two devices of it share an identifier."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cablecomp.config import TomlTable, read_toml, validated
from cablecomp.errors import ConfigError, InputError
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
    InputError with a line for each fault, also where two devices would share an identifier."""
    if "folder" in data:
        raise InputError(f"{where}: unknown key `folder`; remove it or check its spelling")
    lines = data.lines() if isinstance(data, TomlTable) else None
    config = validated(LinkConfig, {**_tuples(data), "folder": folder}, where, lines)
    faults = [*_without_fd(config), *_off_their_line(config), *_not_told_apart(config)]
    if faults:
        raise ConfigError(f"{where}: {fault}" for fault in faults)
    return config


def _without_fd(config: LinkConfig) -> Iterator[str]:
    """Devices that need CAN FD, on a bus without it."""
    if isinstance(config.bus, CanBus) and not config.bus.fd:
        for device in config.device:
            if isinstance(device, MoteusDevice):
                yield (
                    f"device `{device.id}` speaks `{device.protocol}`, which needs CAN FD; set bus.fd = true, on an "
                    "interface that can"
                )


def _off_their_line(config: LinkConfig) -> Iterator[str]:
    """Dynamixel packets that would go over a CAN bus, or share a line with something else."""
    packets = [isinstance(device, DynamixelDevice) for device in config.device]
    if any(packets) and not (all(packets) and isinstance(config.bus, SerialBus)):
        yield (
            'a `dynamixel` needs a line of its own: bus.kind = "serial", and no other protocol on it, is accepted'
        )


def _not_told_apart(config: LinkConfig) -> Iterator[str]:
    """Devices that would send or take frames of the same identifier: the first one of each two."""
    seen: dict[int, list[tuple[str, Claim]]] = {}
    told: set[frozenset[str]] = set()
    try:
        claims = tuple(claims_of(config))
    except InputError as error:  # a model or a message table that is not there
        yield str(error)
        return
    for owner, claim in claims:
        for other, before in seen.setdefault(claim.identifier, []):
            pair = frozenset((owner, other))
            if other != owner and pair not in told and not _may_share(claim, before):
                told.add(pair)
                yield (
                    f"identifier 0x{claim.identifier & 0x1FFF_FFFF:X} would be used by {other} ({before.what}) and by "
                    f"{owner} ({claim.what}), which cannot be told apart; give one of them another node, reply_id or "
                    "message table"
                )
        seen[claim.identifier].append((owner, claim))


def _may_share(a: Claim, b: Claim) -> bool:
    by_number = a.mask != 0 and a.mask == b.mask and a.number != b.number
    return by_number or (a.group != "" and a.group == b.group)
