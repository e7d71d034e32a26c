"""Output that appears whole or not at all."""

from __future__ import annotations

import itertools
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from cablecomp.durable import replace_durably
from cablecomp.errors import InputError, NotWrittenError


@contextmanager
def atomic_directory(out: Path | str, renewed: Sequence[str] = ()) -> Iterator[Path]:
    """Give a temporary directory beside `out`; on success its files appear in `out`, on failure nothing does.

    Files of an existing `out` that are not written anew stay, but for those `renewed`: without a new one the old one
    goes. InputError if `out` cannot be made.
    """
    out = Path(out)
    check_directory(out)
    made = _make_parents(out)
    try:
        temporary = _sibling(out)
    except OSError as error:
        raise NotWrittenError(
            f"{out}: cannot be written ({error.strerror}); choose another directory"
        ) from None
    try:
        yield temporary
        gone = [name for name in renewed if not (temporary / name).exists()]
        _move_into(temporary, out)
        for name in gone:
            (out / name).unlink(missing_ok=True)
    except BaseException as error:
        shutil.rmtree(temporary, ignore_errors=True)
        _remove_empty(made)
        if isinstance(error, OSError):
            raise NotWrittenError(
                f"{out}: cannot be written ({_why(error)}); nothing was left there"
            ) from None
        raise


def check_directory(out: Path, option: str = "--out") -> None:
    """Raise InputError if `out`, the value of an option, can be no directory that files are written into; nothing is
    left there."""
    for place in (out, *out.absolute().parents):
        if place.is_dir():
            if not os.access(place, os.W_OK | os.X_OK):
                raise InputError(f"{out}: may not be written; choose another directory")
            try:
                os.rmdir(
                    tempfile.mkdtemp(prefix=".cablecomp-", dir=place)
                )  # the system may say no all the same
            except OSError as error:
                raise InputError(
                    f"{out}: cannot be written ({_why(error)}); choose another directory"
                ) from None
            return
        if os.path.lexists(place):
            what = "is a file" if place.exists() else "is a link that leads nowhere"
            where = "" if place == out else f"{place} "
            raise InputError(
                f"{out}: {where}{what}; {option} takes a directory, which is made if it is missing"
            )


@contextmanager
def atomic_file(path: Path | str) -> Iterator[Path]:
    """Give a temporary path beside `path`; on success the file takes its place, on failure it is removed."""
    path = Path(path)
    temporary = path.with_name(f".{path.name}.partial-{os.getpid()}")
    try:
        yield temporary
        replace_durably(temporary, path)
    except OSError as error:
        with suppress(OSError):  # where there is no such folder, there is no file either
            temporary.unlink()
        raise NotWrittenError(f"{path}: cannot be written ({_why(error)}); choose another place") from None
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def _sibling(out: Path) -> Path:
    for attempt in itertools.count():
        candidate = out.absolute().with_name(f".{out.absolute().name}.partial-{os.getpid()}-{attempt}")
        try:
            candidate.mkdir()
        except FileExistsError:
            continue
        return candidate
    raise AssertionError("unreachable")


def _move_into(source: Path, target: Path) -> None:
    if not target.exists():
        replace_durably(source, target)
        return
    for item in sorted(source.iterdir()):
        place = target / item.name
        if item.is_dir() and place.is_dir():
            _move_into(item, place)
        else:
            replace_durably(item, place)
    source.rmdir()


def _make_parents(out: Path) -> list[Path]:
    """Make the missing parents of `out` and return them, innermost first."""
    missing = list(itertools.takewhile(lambda parent: not parent.exists(), out.absolute().parents))
    try:
        for parent in reversed(missing):
            parent.mkdir()
    except OSError as error:
        raise InputError(f"{out}: cannot be made ({error.strerror}); choose another directory") from None
    return missing


def _remove_empty(directories: list[Path]) -> None:
    for directory in directories:
        try:
            directory.rmdir()
        except OSError:
            return


def _why(error: OSError) -> str:
    """What the system said; an error raised by a package may carry it in its text alone."""
    return error.strerror or (str(error).splitlines() or ["for no reason given"])[0]
