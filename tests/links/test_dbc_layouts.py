"""Messages taken apart by shifts against cantools' own encoder and decoder."""

from __future__ import annotations

from pathlib import Path
from struct import unpack

import cantools
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cablecomp.errors import InputError
from cablecomp.links import dbc

REAL = {"e": 2, "f": 4, "d": 8}  # bytes of a float, by its kind
CONFIGS = Path(__file__).parents[2] / "configs" / "links"
HEAD = 'VERSION ""\nNS_ :\nBS_:\nBU_: A B\n'


def physical(field: dbc.Field, data: bytes) -> float:
    """Physical value of a field in a frame: `scale counts + offset`, or the float that the bits are."""
    big, little = int.from_bytes(data, "big"), int.from_bytes(data, "little")
    if not field.real:
        return field.scale * dbc.counts_in(field, little, big) + field.offset
    n = (big if field.big else little) >> field.shift & field.mask
    x: float = unpack(">" + field.real, n.to_bytes(REAL[field.real], "big"))[0]
    return field.scale * x + field.offset


def table_of(tmp: Path, body: str) -> Path:
    path = tmp / f"t{abs(hash(body))}.dbc"
    path.write_text(HEAD + body, encoding="ascii")
    return path


@st.composite
def signals(draw) -> list[tuple[str, int, int, bool, bool]]:
    """Signals side by side in 64 bits: name, first bit from the end that the byte order counts from, length,
    signed, big."""
    big, at, out = draw(st.booleans()), 0, []
    while at < 64 and len(out) < 6:
        length = draw(st.integers(1, min(32, 64 - at)))
        out.append((f"s{len(out)}", at, length, draw(st.booleans()) and length > 1, big))
        at += length + draw(st.integers(0, 3))
    return out


def motorola_start(at: int) -> int:
    """DBC start bit of the signal whose first (most significant) bit is the at-th of the message."""
    return 8 * (at // 8) + 7 - at % 8


@settings(max_examples=60, deadline=None)
@given(signals(), st.binary(min_size=8, max_size=8))
def test_counts_are_those_of_cantools(tmp_path_factory, fields, data: bytes) -> None:
    lines = [
        f" SG_ {n} : {motorola_start(at) if big else at}|{length}@{0 if big else 1}{'-' if signed else '+'}"
        ' (0.5,-3) [0|0] "" B'
        for n, at, length, signed, big in fields
    ]
    path = table_of(tmp_path_factory.mktemp("dbc"), "BO_ 100 M: 8 A\n" + "\n".join(lines) + "\n")
    layout = dbc.layout(path, "M")
    theirs = cantools.database.load_file(path).get_message_by_name("M")
    decoded = theirs.decode(data, decode_choices=False)
    for name, field in layout.fields.items():
        assert physical(field, data) == pytest.approx(decoded[name], abs=1e-9)
        read = int.from_bytes(data, "little"), int.from_bytes(data, "big")
        assert dbc.counts_in(field, *read) == round((decoded[name] + 3) / 0.5)
    ours = dbc.encode(layout, decoded)
    assert ours.clipped == ()
    assert ours.data == theirs.encode(decoded, padding=False)


@pytest.mark.parametrize("name", ["cablecomp_joint.dbc", "cablecomp_odrive.dbc", "cablecomp_mit_ak80_9.dbc"])
def test_shipped_tables(name: str) -> None:
    theirs = cantools.database.load_file(CONFIGS / name)
    data = bytes.fromhex("01 23 45 67 89 AB CD 6F")
    for message in theirs.messages:
        if message.is_multiplexed():
            continue
        layout = dbc.layout(CONFIGS / name, message.name)
        cut = data[: message.length]
        for signal, value in message.decode(cut, decode_choices=False).items():
            assert physical(layout.fields[signal], cut) == pytest.approx(value, rel=1e-12, abs=1e-12)


def test_floats_of_both_orders(tmp_path: Path) -> None:
    body = (
        'BO_ 1 M: 8 A\n SG_ l : 0|32@1- (1,0) [0|0] "" B\n SG_ b : 39|32@0- (1,0) [0|0] "" B\n'
        "SIG_VALTYPE_ 1 l : 1;\nSIG_VALTYPE_ 1 b : 1;\n"
    )
    layout = dbc.layout(table_of(tmp_path, body), "M")
    data = bytes.fromhex("00 00 A0 3F 3F A0 00 00")  # 1.25 little end first, then big end first
    assert physical(layout.fields["l"], data) == 1.25
    assert physical(layout.fields["b"], data) == 1.25
    assert dbc.encode(layout, {"l": 1.25, "b": 1.25}).data == data
    assert dbc.encode(layout, {"l": 1e300}).clipped == ("l",)


def test_saturation_nan_and_limits_of_the_table(tmp_path: Path) -> None:
    body = (
        'BO_ 1 M: 2 A\n SG_ x : 0|8@1- (0.1,0) [0|0] "" B\n SG_ y : 8|8@1+ (1,0) [10|20] "" B\n'
        'VAL_ 1 y 12 "twelve" ;\n'
    )
    layout = dbc.layout(table_of(tmp_path, body), "M")
    assert dbc.encode(layout, {"x": 12.7, "y": 20}) == (bytes([127, 20]), ())
    assert dbc.encode(layout, {"x": 99.0, "y": 21}) == (bytes([127, 20]), ("x", "y"))
    assert dbc.encode(layout, {"x": -99.0}).data[0] == 0x80
    assert dbc.choice(layout, "y", "twelve", "here") == 12
    with pytest.raises(InputError, match="finite"):
        dbc.encode(layout, {"x": float("nan")})
    with pytest.raises(InputError, match="it has twelve"):
        dbc.choice(layout, "y", "ten", "here")
    with pytest.raises(InputError, match="it has x, y"):
        dbc.field_of(layout, "z", "here")


@pytest.mark.parametrize(
    ("scale", "offset", "low", "high", "counts"),
    [
        (0.3, 0.0, -3.2, 3.2, (-10, 10)),
        (0.3, 0.0, -3.1, 3.1, (-10, 10)),
        (-0.3, 0.0, -3.2, 3.2, (-10, 10)),
        (0.1, 0.0, -0.3, 0.7, (-3, 7)),  # 0.7 / 0.1 is less than 7 by a digit
        (0.1, 0.0, 0.3, 0.6, (3, 6)),
        (0.001, -20.0, -19.9995, 19.9995, (1, 32767)),
        (0.00038147, 0.0, -12.5, 12.5, (-32767, 32767)),
        (1.0, 0.0, 0.1, 0.8, (0, 0)),  # none lies between
        (1.0, 0.0, 0.0, 0.0, (-32768, 32767)),  # the table states none
    ],
)
def test_the_limits_of_a_table_are_not_exceeded_by_what_lies_between_counts(
    tmp_path: Path, scale: float, offset: float, low: float, high: float, counts: tuple[int, int]
) -> None:
    path = table_of(tmp_path, f'BO_ 291 C: 8 A\n SG_ x : 0|16@1- ({scale},{offset}) [{low}|{high}] "" B\n')
    field = dbc.layout(path, "C").fields["x"]
    assert (field.low, field.high) == counts


def test_bad_tables_end_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        dbc.layout(tmp_path / "none.dbc", "M")
    bad = tmp_path / "bad.dbc"
    bad.write_text("BO_ what\n", encoding="ascii")
    with pytest.raises(InputError, match="no usable message table") as caught:
        dbc.layout(bad, "M")
    assert "\n" not in str(caught.value)
    long = table_of(tmp_path, 'BO_ 1 M: 64 A\n SG_ x : 0|8@1- (1,0) [0|0] "" B\n')
    with pytest.raises(InputError, match="0 to 8 are accepted"):
        dbc.layout(long, "M")
    with pytest.raises(InputError, match="it has M"):
        dbc.layout(long, "N")
