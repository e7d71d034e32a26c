"""`cablecomp guide`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markdown import Markdown
from rich.table import Table

from cablecomp.cli.shared import Output
from cablecomp.durable import write_durably
from cablecomp.errors import InputError
from cablecomp.guide.topics import names, text_of, title_of


def show_guide(
    name: Annotated[str | None, typer.Argument(metavar="[TOPIC]", help="lists the topics if absent")] = None,
    html: Annotated[
        Path | None, typer.Option(help="write the whole guide as one page that opens offline")
    ] = None,
) -> None:
    """Read the guide: recordings, diagnosis, hardware and safety, effects of your own, figures, reference."""
    console = Output()
    text = None if name is None else text_of(name)  # before anything is written
    if html is not None:
        from cablecomp.guide.page import guide_page  # brings the look of all pages, and so plotly

        try:
            write_durably(html, guide_page().encode())
        except OSError as error:
            raise InputError(f"{html}: cannot be written ({error.strerror}); give another file") from None
        console.print(f"guide: {html}", soft_wrap=True)
    if text is not None:
        console.print(Markdown(text))
    elif html is None:
        table = Table(show_header=False, box=None)
        for each in names():
            table.add_row(f"cablecomp guide {each}", title_of(each))
        console.print(table)
