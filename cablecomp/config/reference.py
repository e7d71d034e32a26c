"""Reference of all keys of a configuration file, generated from its model."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Annotated, Any, Final, Literal, NamedTuple, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from cablecomp.units import suffix_of

CONVENTIONS: Final = """\
Signs. Both pulleys turn positive together: the rigid drive is R q_out = r q_in. A positive external moment M on
the joint turns it along +q_out; motor torque is positive along +q_in; deflection = q_out - (r/R) q_in.

       input pulley, r                                     output pulley, R
         .-------.    ---------- cable h ---------->         .-------.
         | +q_in |    +q_out winds h on at the output,       | +q_out|  <- M, external, along +q_out
         |   ->  |    +q_in pays h out at the input          |  ->   |
         '-------'    <--------- cable l -----------         '-------'
    M > 0 tightens h.   wrap(h, out) = w_out + q_out    wrap(h, in) = w_in - q_in
                        wrap(l, out) = w_out - q_out    wrap(l, in) = w_in + q_in

Effective radius = bare pulley radius + half the cable diameter: where the cable's centre runs.
Wrap = angle from where the cable leaves the pulley at position zero to where it is fixed, whole turns included.
Units are SI; every key ends in its unit. Noise is 1 sigma.
"""


_ARRAY: Final = "[]"
_COMPOUND: Final = {
    "Nm_per_rad": "Nm/rad",
    "Nms_per_rad": "Nm s/rad",
    "Nm_per_A": "Nm/A",
    "Nm_s": "Nm/s",
    "per_s": "1/s",
    "turns_s": "turns/s",
    "kgm2": "kg m2",
    "deg": "deg",
}
_SPELT: Final = {"rad_s": "rad/s"}


class Key(NamedTuple):
    """One key: name, unit, what is accepted, default, meaning."""

    name: str
    unit: str
    accepted: str
    default: str
    meaning: str


class Table(NamedTuple):
    """One table of a file: how its head is written, what it is, its keys."""

    head: str
    text: str
    keys: tuple[Key, ...]


def tables_of(model: type[BaseModel], name: str = "", head: str = "(top of the file)") -> Iterator[Table]:
    """A model's table and all tables in it, in the order of the file."""
    keys, inside = [], []
    for key, field in ((f.alias or n, f) for n, f in model.model_fields.items()):
        kinds, shape = _kinds(field.annotation)
        keys += [] if kinds else [_key(key, field)]
        place = f"{name}.{key}{shape}" if name else f"{key}{shape}"
        inside += [(place, kind, len(kinds) > 1) for kind in kinds]
    yield Table(head, inspect.getdoc(model) or "", tuple(keys))
    for place, kind, several in inside:
        shown = f"[[{place.removesuffix(_ARRAY)}]]" if place.endswith(_ARRAY) else f"[{place}]"
        place = place.removesuffix(_ARRAY)
        yield from tables_of(kind, place, f"{shown} {_tag(kind)}" if several else shown)


def reference(model: type[BaseModel], preface: str = "") -> str:
    """The reference as text: `preface`, then each table with its own words and its keys."""
    lines = [preface]
    for table in tables_of(model):
        lines += ["", table.head, *(f"  {line}".rstrip() for line in table.text.splitlines())]
        lines += [f"  {_with_unit(key)}: {_words(key)}" for key in table.keys]
    return "\n".join(lines).strip("\n") + "\n"


def keys_of(model: type[BaseModel]) -> Iterator[tuple[str, str]]:
    """Every key of a model itself with its unit, and its words: of a table in it, what that is."""
    for key, field in ((f.alias or n, f) for n, f in model.model_fields.items()):
        kinds, shape = _kinds(field.annotation)
        if kinds:
            inside = " | ".join(k.__name__ for k in kinds)
            yield key, {"": inside, _ARRAY: f"array of {inside}"}.get(shape, f"table of {inside} by name")
        else:
            found = _key(key, field)
            yield _with_unit(found), _words(found)


def _with_unit(key: Key) -> str:
    return f"{key.name} [{key.unit}]" if key.unit else key.name


def _words(key: Key) -> str:
    return "; ".join(w for w in (key.meaning, key.accepted, key.default) if w)


def _tag(kind: type[BaseModel]) -> str:
    """What chooses this one of several kinds of table: its first key with a single accepted value."""
    for name, field in kind.model_fields.items():
        if get_origin(field.annotation) is Literal and field.is_required():
            return f"with {name} = {' | '.join(repr(v) for v in get_args(field.annotation))}"
    return ""


def _key(name: str, field: FieldInfo) -> Key:
    if field.is_required():
        default = "required"
    else:
        value = field.get_default(call_default_factory=True, validated_data={})
        default = "default: absent" if value is None or value in ({}, ()) else f"default {value!r}"
    return Key(name, _unit(name), _accepted(field), default, field.description or "")


def _unit(name: str) -> str:
    special = next((unit for end, unit in _COMPOUND.items() if name.endswith(f"_{end}")), None)
    return special or _SPELT.get(suffix_of(name) or "", suffix_of(name) or "")


def _kinds(annotation: Any) -> tuple[tuple[type[BaseModel], ...], str]:
    """The models that an annotation stands for, and how: one table, an array of them, or each under a name."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return (annotation,), ""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _kinds(inner[0])
    found = [_kinds(part) for part in inner]
    shape = _ARRAY if origin is tuple else ".NAME" if origin is dict else "".join(s for _, s in found)
    return tuple(m for kinds, _ in found for m in kinds), shape


def _accepted(field: FieldInfo) -> str:
    words = kind_of(field.annotation)
    limits = [_limit(m) for m in field.metadata]
    return ", ".join(dict.fromkeys([words, *(w for w in limits if w)]))


def kind_of(annotation: Any) -> str:
    """What an annotation accepts, in words."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return " | ".join(repr(v) for v in inner)
    if origin is Annotated:
        limits = [_limit(m) for part in inner[1:] for m in getattr(part, "metadata", (part,))]
        return " ".join([kind_of(inner[0]), *dict.fromkeys(w for w in limits if w)])
    if origin is tuple:
        return f"array of {kind_of(inner[0])}"
    if origin is dict:
        return f"table of {kind_of(inner[1])}"
    if origin is not None:  # a union
        return " | ".join(kind_of(part) for part in inner if part is not type(None))
    plain = {float: "number", int: "whole number", str: "text", bool: "true | false"}
    return plain.get(annotation, getattr(annotation, "__name__", "anything"))


def _limit(mark: Any) -> str:
    for name, words in (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<=")):
        if getattr(mark, name, None) is not None:
            return f"{words} {getattr(mark, name):g}"
    return ""
