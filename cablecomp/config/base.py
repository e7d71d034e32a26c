"""What every configuration model shares: frozen and strict, an unknown key fails, numbers are finite."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Text = Annotated[str, Field(min_length=1)]


class Frozen(BaseModel):
    """A table of a configuration file."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def listed(most: int) -> BeforeValidator:
    """Take TOML's arrays, which arrive as lists, as the tuples that strict models want; `most` entries."""

    def row(value: Any) -> Any:
        if isinstance(value, list | tuple) and len(value) > most:
            raise ValueError(f"{len(value)} entries; at most {most} are accepted")
        return tuple(value) if isinstance(value, list) else value

    return BeforeValidator(row)


Listed = listed(4096)
