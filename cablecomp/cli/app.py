"""The list of commands, and how they end: 0 done, 2 bad input, 3 device (also: a run that had to stop the
joint), 4 our own fault.

A command's module is imported when it is called, so that `--help` need not wait for compilers and solvers.
"""

from __future__ import annotations

import ast
import difflib
import os
import re
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from io import TextIOWrapper
from pathlib import Path
from types import FrameType
from typing import Annotated, Any, Final

import typer
from typer.core import TyperCommand, TyperGroup

from cablecomp import __version__
from cablecomp.errors import CablecompError, ConfigError, DeviceError, InputError, InternalError, printable

COMMANDS: Final = {
    "guide": "guide.show_guide",
    "demo": "demo.demo",
    "example": "example.copy_example",
    "run": "run.run",
    "replay": "replay.replay",
    "inspect": "inspect.inspect_recording",
    "convert": "convert.convert_recording",
    "init": "init.init",
    "calibrate": "calibrate.calibrate_joint",
    "info": "info.info",
    "design": "design.design",
    "identify": "identify.identify",
    "diagnose": "diagnose.diagnose_recordings",
    "export": "export.export",
    "prove": "prove.prove_blindly",
    "study": "study.study_bench",
}
"""Command: its module here and function."""


class Once(TyperCommand):
    """A command whose options are given once, unless they say otherwise: of two values, one would be ignored."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """As usual; raises InputError for an option given twice."""
        before = args[: args.index("--")] if "--" in args else args
        for option in (p for p in self.params if p.param_type_name == "option" and not p.multiple):
            names = (*option.opts, *option.secondary_opts)
            given = [a for a in before if a.partition("=")[0] in names]
            if len(given) > 1:
                raise InputError(f"{ctx.info_name}: {names[0]} is given {len(given)} times; give it once")
        return super().parse_args(ctx, args)


class Commands(TyperGroup):
    """A group that knows its commands by name and loads one when it is asked for."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names in the order of `COMMANDS`."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command, its module imported; None if there is none of this name."""
        if cmd_name not in COMMANDS:
            return None
        module, function = COMMANDS[cmd_name].split(".")
        single = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
        with _interruptible():
            loaded = import_module(f"cablecomp.cli.{module}")
        single.command(cmd_name, cls=Once)(getattr(loaded, function))
        return typer.main.get_command(single)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """One line for each command: the first of its docstring, read without importing it."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, first_line(place)) for name, place in COMMANDS.items()])


@contextmanager
def _interruptible() -> Iterator[None]:
    """Ctrl-C within ends the program, even where a package that is being imported takes the KeyboardInterrupt for a
    sign that something else is not there."""
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.default_int_handler or threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed = False

    def heard(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        pressed = True
        signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, heard)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if pressed:
            raise KeyboardInterrupt


def first_line(place: str) -> str:
    """First sentence of the docstring of `module.function` in this package."""
    module, function = place.split(".")
    tree = ast.parse((Path(__file__).parent / f"{module}.py").read_text(encoding="utf-8"))
    (found,) = [n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == function]
    return " ".join((ast.get_docstring(found) or "").split("\n\n")[0].split())


INTERRUPTED = 130
"""Exit code of a command that was stopped by Ctrl-C."""

app = typer.Typer(
    cls=Commands,
    help="Real-time hysteresis compensator for cable-driven joints.",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"cablecomp {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    shown: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="show the version")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point: runs a command, turns errors into one line on stderr and an exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a name may hold what the terminal cannot show
    try:
        code = app(args=list(sys.argv[1:] if arguments is None else arguments), standalone_mode=False)
        if sys.stdout is not None:  # closed from the start
            sys.stdout.flush()
        if code == INTERRUPTED:
            return _fail("stopped by the user", INTERRUPTED)
        return code if isinstance(code, int) else 0
    except ConfigError as error:
        return max(_fail(line, 2) for line in error.lines)
    except InputError as error:
        return _fail(str(error), 2)
    except DeviceError as error:
        return _fail(str(error), 3)
    except InternalError as error:
        return _fail(f"{error} (a fault of this program: please report it)", 4)
    except CablecompError as error:
        return _fail(str(error), 4)
    except (KeyboardInterrupt, typer.Abort):  # the latter where a question is answered by Ctrl-C or Ctrl-D
        return _fail("stopped by the user", INTERRUPTED)
    except BrokenPipeError:  # whoever read our output has enough
        _drop_output()
        return 0
    except OSError as error:  # a full disk, a place that may not be written: what was there stays as it was
        _drop_output()
        return _fail(
            f"{error.filename or 'output'}: {error.strerror or error}; free some space or choose another place",
            2,
        )
    except MemoryError:
        return _fail("not enough memory; give a shorter recording", 2)
    except Exception as error:
        shown = getattr(error, "format_message", None)
        if shown is None:  # neither ours nor the command line's: a bug, whose traceback is worth having
            raise
        return _fail(_misused(error, shown().rstrip(".")), 2)


def _fail(text: str, code: int) -> int:
    with suppress(OSError):  # whoever was to read it may be gone
        print(f"cablecomp: {printable(text)}", file=sys.stderr)
    return code


def _misused(error: Exception, said: str) -> str:
    """What the command line found wrong, the command that is nearest, and whose help to read."""
    context = getattr(error, "ctx", None)
    asked = f" {context.info_name}" if context is not None and context.parent is not None else ""
    meant = re.search(r"No such command '([^']*)'", said)
    close = difflib.get_close_matches(meant[1], COMMANDS, 1) if meant else []
    return f"{said}{f'; did you mean `{close[0]}`?' if close else ''}; see cablecomp{asked} --help"


def _drop_output() -> None:
    """Let nothing more be tried on a standard output that took no more."""
    with suppress(OSError, ValueError, AttributeError):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())
        os.close(nothing)
