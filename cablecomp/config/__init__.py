"""Joint configuration: TOML to frozen objects; an unknown key fails.

Imports errors, units and the shipped examples alone. Start reading at `schema.py` (the whole file), then
`drive.py`; `load.py` reads it.
"""

from cablecomp.config.base import Finite, Frozen, NonNegative, Positive, Text
from cablecomp.config.doubts import doubts
from cablecomp.config.drive import Drive, Stage, ratios_to_last
from cablecomp.config.load import load_joint, parse_joint, validated
from cablecomp.config.options import EffectEntry, Limits, ObserverOptions, Remainder, Sensors
from cablecomp.config.schema import JointConfig
from cablecomp.config.sessions import Depends, Empirical, Session
from cablecomp.config.toml_file import TomlTable, read_toml
from cablecomp.config.values import claimed_by, claiming, in_session, session_of, with_laws_of, with_values

__all__ = [
    "Depends",
    "Drive",
    "EffectEntry",
    "Empirical",
    "Finite",
    "Frozen",
    "JointConfig",
    "Limits",
    "NonNegative",
    "ObserverOptions",
    "Positive",
    "Remainder",
    "Sensors",
    "Session",
    "Stage",
    "Text",
    "TomlTable",
    "claimed_by",
    "claiming",
    "doubts",
    "in_session",
    "load_joint",
    "parse_joint",
    "ratios_to_last",
    "read_toml",
    "session_of",
    "validated",
    "with_laws_of",
    "with_values",
]
