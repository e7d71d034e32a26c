"""Joint configuration: TOML to frozen objects; an unknown key fails."""

from cablecomp.config.base import Finite, NonNegative, Positive
from cablecomp.config.load import explain, load_joint, parse_joint, read_toml, validated
from cablecomp.config.schema import Drive, EffectEntry, JointConfig, Limits, ObserverOptions, Sensors, Stage
from cablecomp.config.sessions import Empirical, Session
from cablecomp.config.values import in_session, session_of, with_values

__all__ = [
    "Drive",
    "EffectEntry",
    "Empirical",
    "Finite",
    "JointConfig",
    "Limits",
    "NonNegative",
    "ObserverOptions",
    "Positive",
    "Sensors",
    "Session",
    "Stage",
    "explain",
    "in_session",
    "load_joint",
    "parse_joint",
    "read_toml",
    "session_of",
    "validated",
    "with_values",
]
