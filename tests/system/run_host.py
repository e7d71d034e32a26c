"""A process that has everything imported and compiled, and forks a `cablecomp` command on each line that it reads:

    {"arguments": [...], "cwd": "...", "said": "file for output", "terminal": "pseudo-terminal or null"}

Its first line says which of loop design's slow tools are loaded; then it answers with the child's process id and, when
that has ended, with its exit code (negative: the signal).
"""

from __future__ import annotations

import json
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path


def main() -> None:
    """Read lines until standard input closes."""
    from cablecomp.cli import main as command
    from cablecomp.cli import run
    from cablecomp.config import load_joint
    from cablecomp.observer import Observer
    from cablecomp.report import run_page

    assert run
    assert run_page
    Observer(load_joint(Path(sys.argv[1])), bounds=True).compile()
    tell(sorted({"control", "scipy.signal"} & set(sys.modules)))
    for line in sys.stdin:
        wanted = json.loads(line)
        child = os.fork()
        if child == 0:
            os._exit(in_child(command, wanted))
        tell(child)
        _, status = os.waitpid(child, 0)
        tell(os.waitstatus_to_exitcode(status))


def in_child(command, wanted: dict) -> int:
    """The command, in its own session; standard input, output and error where they are wanted."""
    os.setsid()
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # it may be ignored where the tests run in the background
    os.chdir(wanted["cwd"])
    place = wanted["terminal"] or wanted["said"]
    handle = os.open(place, os.O_RDWR | os.O_CREAT | os.O_APPEND)
    if wanted["terminal"]:
        import fcntl
        import termios

        fcntl.ioctl(handle, termios.TIOCSCTTY, 0)
    for number in range(3):
        os.dup2(handle, number)
    # what Python opened on a file believes that it can seek; a terminal cannot
    streams = (open(n, "w", 1, encoding="utf-8", closefd=False) for n in (1, 2))  # noqa: SIM115 -- open to the end
    sys.stdout, sys.stderr = streams
    if wanted.get("file_limit"):
        import resource

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (wanted["file_limit"], wanted["file_limit"]))
    try:
        code = command(wanted["arguments"])
    except BaseException:
        import traceback

        traceback.print_exc()
        code = 99
    with suppress(OSError):
        sys.stdout.flush()
    return code


def tell(what: object) -> None:
    print(json.dumps(what), flush=True)


if __name__ == "__main__":
    main()
