"""`cablecomp init`."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from typing import Annotated, Any, Final, get_args, get_origin

import typer

from cablecomp.cli.folders import out_option
from cablecomp.cli.shared import JsonOption, console, each_once, echo_json, warn
from cablecomp.config import doubts, load_joint, read_toml, validated
from cablecomp.config.draft import Draft, draft_text
from cablecomp.config.reference import CONVENTIONS, reference
from cablecomp.config.schema import JointConfig
from cablecomp.config.toml_file import value_text
from cablecomp.control.options import ControlConfig
from cablecomp.errors import ConfigError, InputError
from cablecomp.examples import example, with_companions
from cablecomp.links.schema import LinkConfig
from cablecomp.recording.atomic import atomic_file

_FILES: Final = (
    (Draft, "WHAT `cablecomp init` ASKS (--from, --set)"),
    (JointConfig, "JOINT FILE (--config)"),
    (ControlConfig, "CONTROL FILE (--control)"),
    (LinkConfig, "LINK FILE (--link)"),
)
_LINKS: Final = {
    "moteus": "moteus-socketcan",
    "odrive": "odrive-socketcan",
    "cubemars": "cubemars-servo-socketcan",
    "robstride": "robstride-socketcan",
    "damiao": "damiao-socketcan",
    "mit": "mit-socketcan",
}


def init(
    out: Annotated[Path, out_option("folder for joint.toml, link.toml")] = Path(),
    answers: Annotated[
        Path | None, typer.Option("--from", help="TOML file with the answers (see --keys); nothing is asked")
    ] = None,
    given: Annotated[
        list[str] | None, typer.Option("--set", help="one answer, KEY=VALUE, such as cable=steel-7x7")
    ] = None,
    keys: Annotated[
        bool, typer.Option("--keys", help="every key of the answers, of joint, control and link files")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """A joint file from what you know (asked, or by --set and --from); --keys: what can stand in a configuration."""
    if keys:
        typer.echo(CONVENTIONS)
        for model, head in _FILES:
            typer.echo(reference(model, f"{head}\n{'=' * len(head)}"))
        return
    values = dict(read_toml(answers)) if answers is not None else {}
    values |= each_once("--set", map(_answer, given or ()))
    if answers is None and not given:
        if not sys.stdin.isatty():
            raise InputError(
                "init: nobody to ask; give --set KEY=VALUE or --from FILE (cablecomp init --keys lists the keys)"
            )
        _refuse_to_overwrite(out / "joint.toml")
        values = _asked()
    place = "init" if answers is None else f"{answers} with --set" if given else str(answers)
    draft = validated(Draft, values, place)
    files = {"joint.toml": draft_text(draft), **_link(draft)}
    for name, text in files.items():
        _refuse_to_overwrite(out / name, text)
    out.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        with atomic_file(out / name) as spare:
            spare.write_text(text, encoding="utf-8")
    asked = doubts(load_joint(out / "joint.toml"))
    if as_json:
        echo_json({"written": [out / name for name in files], "doubts": asked})
        return
    for name in files:
        console.print(f"written: {out / name}", soft_wrap=True)
    warn(f"{out / 'joint.toml'}: {words}" for words in asked)


def _refuse_to_overwrite(place: Path, text: str | None = None) -> None:
    """Raise InputError where another text stands (None: any)."""
    there = place.read_text(encoding="utf-8", errors="replace") if place.is_file() else None
    if place.exists() and (text is None or there != text):
        raise InputError(f"{place}: is there already, and differs; remove it or give another --out")


def _answer(word: str) -> tuple[str, Any]:
    """A KEY=VALUE as TOML would have it; what is no number is text, with quotes around it or without."""
    key, equals, text = word.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {word}: KEY=VALUE is accepted, such as cable=steel-7x7")
    quoted = re.fullmatch(r'\s*"([^"]*)"\s*', text)
    if quoted is not None:
        return key.strip(), quoted[1]
    try:
        return key.strip(), float(text)
    except ValueError:
        return key.strip(), text.strip()


def _asked() -> dict[str, Any]:
    """Ask for every key, again where an answer will not do; an empty one takes the default, or leaves it out."""
    values: dict[str, Any] = {}
    left = list(Draft.model_fields)
    while left:
        key, answer = left[0], _prompted(left[0])
        tried = values if answer == "" else values | dict([_answer(f"{key}={answer}")])
        wrong = _wrong(tried, key, left[1:])
        for line in wrong:
            typer.echo(line)
        if not wrong:
            values = tried
            del left[0]
    return values


def _prompted(key: str) -> str:
    field = Draft.model_fields[key]
    choices = get_args(field.annotation) if str(get_origin(field.annotation)) == "typing.Literal" else ()
    words = f"{key}: {field.description}" + (f" ({', '.join(map(str, choices))})" if choices else "")
    if not field.is_required() and field.default is None:
        return str(typer.prompt(f"{words} [Enter leaves it out]", default="", show_default=False))
    if field.is_required():
        return str(typer.prompt(f"{words} [needed]"))
    return str(typer.prompt(words, default=str(field.default)))


def _wrong(values: dict[str, Any], key: str, later: list[str]) -> tuple[str, ...]:
    """What is wrong with the answers that is of this key, and of none that is still to be asked for."""
    try:
        validated(Draft, values, "init")
    except ConfigError as error:
        return tuple(line for line in error.lines if key in line and not any(name in line for name in later))
    return ()


def _link(draft: Draft) -> dict[str, str]:
    """The example link of this drive, its joint under the joint's name, and the message tables that it names."""
    if draft.drive == "none":
        return {}
    source = example("links", _LINKS[draft.drive])
    text = source.read_text(encoding="utf-8")
    head, joint, tail = text.partition("[[joint]]")
    tail = re.sub(
        r'^name = "[^"]*"', lambda _: f"name = {value_text(draft.name)}", tail, count=1, flags=re.MULTILINE
    )
    text = f"# Written by `cablecomp init`: check channel, node and limits against your drive.\n{head}{joint}{tail}"
    tomllib.loads(text)
    beside = {p.name: p.read_text(encoding="utf-8") for p in with_companions(source)[1:]}
    return {"link.toml": text, **beside}
