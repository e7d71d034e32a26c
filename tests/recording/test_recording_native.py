"""What native code prints to the error output while a file is read."""

from __future__ import annotations

import os

import pytest

from cablecomp.recording.native import held_errors


def say(words: str) -> None:
    os.write(2, words.encode())


def test_words_are_held_and_passed_on_unless_the_reading_fails(capfd: pytest.CaptureFixture[str]) -> None:
    def panic() -> None:
        with held_errors():
            say("a panic")
            raise ValueError("the caller's")

    with held_errors():
        say("within, ")
        assert capfd.readouterr().err == ""
    with pytest.raises(ValueError, match="the caller"):
        panic()
    say("after")
    assert capfd.readouterr().err == "within, after"


def test_where_the_error_output_is_closed_nothing_is_held() -> None:
    kept = os.dup(2)
    os.close(2)
    try:
        with held_errors():
            pass
    finally:
        os.dup2(kept, 2)
        os.close(kept)
