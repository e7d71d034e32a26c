"""What is wrong with a configuration, one line for each error: key, what was found, what is accepted."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Final, NamedTuple, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from cablecomp.config.toml_file import Place, key_text
from cablecomp.units import stated_unit, unit_named

_MOST_LINES: Final = 20
_ACCEPTED: Final = {
    "float_type": "a number is accepted",
    "float_parsing": "a number is accepted",
    "int_type": "a whole number is accepted",
    "int_from_float": "a whole number is accepted",
    "string_type": "text in quotes is accepted",
    "string_too_short": "text that is not empty is accepted",
    "int_parsing_size": "a whole number is accepted",
    "bool_type": "true or false is accepted",
    "finite_number": "a finite number is accepted",
    "greater_than": "a number above {gt:g} is accepted",
    "greater_than_equal": "a number of at least {ge:g} is accepted",
    "less_than": "a number below {lt:g} is accepted",
    "less_than_equal": "a number of at most {le:g} is accepted",
    "literal_error": "{expected} is accepted",
    "tuple_type": "an array is accepted",
    "dict_type": "a table is accepted",
    "model_type": "a table is accepted",
    "too_short": "at least {min_length} is accepted",
    "too_long": "at most {max_length} are accepted",
}


class _Found(NamedTuple):
    """One error: its place in the file (a union's tags left out), and the model that the key belongs to."""

    place: Place
    model: type[BaseModel] | None
    error: ErrorDetails


def explain(
    error: ValidationError, model: type[BaseModel], data: Any, lines: Mapping[Place, int] | None = None
) -> list[str]:
    """One line for each thing wrong, in the file's order as far as it is known; at most 20."""
    found = [_locate(e, model, data) for e in error.errors(include_url=False) if not _echo(e)]
    answered = {name for f in found for name in _near(f, data)}
    said: dict[str, int | None] = {}
    for f in found:
        if f.error["type"] == "missing" and (f.place[:-1], f.place[-1]) in answered:
            continue  # a misspelt key stands there, and its own line says so
        said[_sentence(f, data)] = (lines or {}).get(f.place)
    ordered = sorted(said, key=lambda words: (said[words] is None, said[words] or 0))
    texts = [words if said[words] is None else f"line {said[words]}: {words}" for words in ordered]
    more = len(texts) - _MOST_LINES
    return texts if more <= 0 else [*texts[:_MOST_LINES], f"and {more} more errors"]


def _sentence(found: _Found, data: Any) -> str:
    kind, value, context = found.error["type"], found.error["input"], found.error.get("ctx", {})
    key = _spelt(found.place)
    if kind == "extra_forbidden":
        return f"unknown key `{key}`{_suggested(found, data)}"
    if kind == "missing":
        return f"missing key `{key}`{_meaning(found)}; add it"
    if kind == "value_error":
        reason = str(context.get("error", found.error["msg"]))
        return f"`{key}`: {reason}" if key and not reason.startswith("[") else reason
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        tags = context.get("expected_tags", "")
        name = str(context.get("discriminator", "")).strip("'")
        given = f" is '{context['tag']}'" if "tag" in context else " is missing"
        return f"key `{key}.{name}`{given}; {tags or 'one of the known kinds'} is accepted"
    words = _ACCEPTED.get(kind)
    accepted = (
        found.error["msg"][0].lower() + found.error["msg"][1:] if words is None else words.format(**context)
    )
    return f"key `{key or '(top level)'}` is {_shown(value)}; {accepted}{_dotted(found)}"


def _dotted(found: _Found) -> str:
    """What to do where TOML took a name of parameters (`effect.ID.KEY`) for tables."""
    name, value = str(found.place[-1] if found.place else ""), found.error["input"]
    if found.model is not None or found.error["type"] != "float_type" or not isinstance(value, dict):
        return ""
    while isinstance(value, dict) and value:
        key, value = next(iter(value.items()))
        name += f".{key}"
    return f"; a name with dots goes in quotes: {key_text(name)}"


def _echo(error: ErrorDetails) -> bool:
    """Whether an array is called too short only because its entries were refused."""
    return error["type"] == "too_short" and len(error["input"]) >= error.get("ctx", {}).get("min_length", 0)


def _locate(error: ErrorDetails, model: type[BaseModel], data: Any) -> _Found:
    """Follow an error's location through data and models together; what is in neither is a union's tag."""
    place: list[str | int] = []
    at: type[BaseModel] | None = model
    owner: type[BaseModel] | None = model
    value: Any = data
    kinds: tuple[type[BaseModel], ...] = ()
    for k, part in enumerate(error["loc"]):
        last = k == len(error["loc"]) - 1
        inside = _inside(value, part)
        if not inside and not (last and error["type"] == "missing"):
            at = next((m for m in kinds if _tagged(m, part)), at)
            owner = at
            continue
        place.append(part)
        owner = at
        value = value[part] if inside else None
        if isinstance(part, str) and at is not None:
            kinds = _models(_annotation(at, part))
            at = kinds[0] if kinds else None
    return _Found(tuple(place), owner, error)


def _inside(value: Any, part: str | int) -> bool:
    if isinstance(value, dict):
        return part in value
    return isinstance(value, list | tuple) and isinstance(part, int) and part < len(value)


def _annotation(model: type[BaseModel], key: str) -> Any:
    for name, field in model.model_fields.items():
        if key in (name, field.alias):
            return field.annotation
    return None


def _models(annotation: Any) -> tuple[type[BaseModel], ...]:
    """The models that an annotation may stand for, through unions, tuples and Annotated."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return (annotation,)
    if get_origin(annotation) is Annotated:
        return _models(get_args(annotation)[0])
    return tuple(m for inner in get_args(annotation) for m in _models(inner))


def _tagged(model: type[BaseModel], tag: str | int) -> bool:
    return model.__name__ == tag or any(tag in get_args(f.annotation) for f in model.model_fields.values())


def _near(found: _Found, data: Any) -> Iterator[tuple[Place, str]]:
    """The key that a misspelt one means, with its table."""
    if found.error["type"] == "extra_forbidden":
        name, _ = _meant(found, data)
        if name is not None:
            yield found.place[:-1], name


def _suggested(found: _Found, data: Any) -> str:
    name, value = _meant(found, data)
    if name is not None:
        return f"; did you mean `{name}{'' if value is None else f' = {value:.9g}'}`?"
    free = _free_keys(found, data)
    return f"; known here: {', '.join(free[:24])}" if free else "; remove it"


def _meant(found: _Found, data: Any) -> tuple[str | None, float | None]:
    """The known key that an unknown one is close to, and its value where another unit was written."""
    given, value = str(found.place[-1]), found.error["input"]
    number = float(value) if isinstance(value, int | float) and abs(value) < 1e300 else None
    free = _free_keys(found, data)
    for name in free:
        own = stated_unit(name)
        if own is None:
            continue
        stem = own.stem.lower()
        if given.lower() in (stem, name.lower()):
            return name, None
        written = given[len(stem) + 1 :] if given.lower().startswith(f"{stem}_") else ""
        unit = unit_named(written, own.table)
        if unit is not None and number is not None:
            return name, (unit.factor * number + unit.offset - own.unit.offset) / own.unit.factor
        if unit is not None:
            return name, None
    folded = {name.lower(): name for name in free}
    close = difflib.get_close_matches(given.lower()[:80], folded, 1, 0.7)
    return (folded[close[0]], None) if close else (None, None)


def _free_keys(found: _Found, data: Any) -> list[str]:
    """The keys of the table that are not in use."""
    if found.model is None:
        return []
    table = data
    for part in found.place[:-1]:
        table = table[part]
    names = [field.alias or name for name, field in found.model.model_fields.items()]
    return [name for name in names if not (isinstance(table, dict) and name in table)]


def _meaning(found: _Found) -> str:
    if found.model is None:
        return ""
    for name, field in found.model.model_fields.items():
        if found.place[-1] in (name, field.alias) and field.description:
            return f" ({field.description})"
    return ""


def _spelt(place: Place) -> str:
    return ".".join(str(part + 1) if isinstance(part, int) else part for part in place)


def _shown(value: Any) -> str:
    try:
        words = repr(value)
    except ValueError:  # an integer of thousands of digits
        return "a number with too many digits"
    return words if len(words) < 60 else f"{words[:57]}..."
