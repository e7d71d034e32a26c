"""The guide is shown, written as one page, and its reference holds every public name."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

import cablecomp
from cablecomp.cli import main
from cablecomp.guide import topics


@pytest.mark.parametrize("name", topics.names())
def test_every_topic_is_listed_and_shown(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["guide"]) == 0
    assert f"cablecomp guide {name} " in capsys.readouterr().out
    assert main(["guide", name]) == 0
    said = capsys.readouterr().out
    assert topics.title_of(name) in said
    assert "not run" not in said


def test_an_unknown_topic_names_those_there_are_and_leaves_no_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["guide", "cooking", "--html", str(tmp_path / "guide.html")]) == 2
    assert "hardware" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


class _Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.fetched: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if key == "id":
                self.ids.append(value or "")
            elif key == "href" and tag == "a":
                self.links.append(value or "")
            elif key in ("src", "href"):
                self.fetched.append(value or "")


def test_the_page_fetches_nothing_and_its_links_lead_somewhere(tmp_path: Path) -> None:
    assert main(["guide", "--html", str(tmp_path / "guide.html")]) == 0
    page = _Page()
    page.feed((tmp_path / "guide.html").read_text(encoding="utf-8"))
    assert page.fetched == []
    assert len(set(page.ids)) == len(page.ids) == len(topics.names())
    assert {link.removeprefix("#") for link in page.links if link.startswith("#")} == set(page.ids)


def test_a_page_that_cannot_be_written_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["guide", "--html", str(tmp_path / "no" / "guide.html")]) == 2
    assert "guide.html" in capsys.readouterr().err


def test_the_reference_holds_every_public_name() -> None:
    text = topics.text_of(topics.REFERENCE)
    headings = set(re.findall(r"^### (\w+)$", text, re.MULTILINE))
    assert set(cablecomp.__all__) <= headings
    assert "`Observer.step`" in text


def test_the_reference_tells_a_configurations_keys_in_words() -> None:
    text = topics.text_of(topics.REFERENCE)
    assert not re.search(r"FieldInfo|Annotated|Pydantic", text)
    assert "- `sensors`: Sensors\n- `effect`: array of EffectEntry\n" in text
    assert (
        "- `joint_torque_offset_Nm [Nm]`: what the joint torque sensor reads without load; number; default 0.0"
        in text
    )
    assert "### Positive\n\nA number > 0." in text


def test_the_guide_says_of_confidence_what_its_file_holds() -> None:
    text = " ".join(topics.text_of("trials").split())
    file = Path(cablecomp.__file__).parent / "diagnosis" / "explain" / "confidence.json"
    told = json.loads(file.read_text(encoding="utf-8"))
    learnt, left_out = told["learnt_on"], told["on_laws_left_out"]
    assert f"On {learnt['effects']} effects of {learnt['laws']} laws" in text
    assert f"in {sum(run['trials'] for run in learnt['runs'])} trials" in text
    error, brier = left_out["calibration_error"], left_out["brier"]
    assert f"calibration error {error:.2f}, Brier score {brier:.3f}" in text
    assert f"conformal level is {told['conformal']['level']:.1f}" in text
