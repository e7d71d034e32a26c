"""The guide's topics: which there are, in which order, and their text."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from cablecomp.errors import InputError

FOLDER: Final = Path(__file__).parent
ORDER: Final = (
    "first-hour",
    "recordings",
    "diagnosis",
    "hardware",
    "library",
    "effects",
    "figures",
    "trials",
    "real-recordings",
    "thesis",
)
"""Topics in reading order; any other file of the folder comes after them."""
REFERENCE: Final = "reference"
"""The topic that is made from the docstrings."""


def names() -> tuple[str, ...]:
    """Names of the topics in reading order, the reference last."""
    files = {path.stem for path in FOLDER.glob("*.md")}
    known = [name for name in ORDER if name in files]
    return (*known, *sorted(files - set(known)), REFERENCE)


def text_of(name: str) -> str:
    """Markdown of a topic, its title on the first line; raises InputError with the names there are."""
    if name not in names():
        raise InputError(f"no topic `{name}` in the guide; there are {', '.join(names())}")
    if name == REFERENCE:
        from cablecomp.guide.reference import reference  # imports all that it describes

        return reference()
    return (FOLDER / f"{name}.md").read_text(encoding="utf-8")


def title_of(name: str) -> str:
    """Title of a topic."""
    return (
        "Reference of the public names"
        if name == REFERENCE
        else text_of(name).split("\n", 1)[0].removeprefix("# ")
    )
