from cablecomp.counting import counted


def test_one_is_no_plural() -> None:
    assert [counted(n, "recording") for n in (0, 1, 2, 3132)] == [
        "0 recordings",
        "1 recording",
        "2 recordings",
        "3,132 recordings",
    ]
