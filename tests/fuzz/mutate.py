"""Files with something wrong in them, drawn from good ones: what is drawn depends on a seed alone.

A text's numbers, words, lines and encoding are changed; of other bytes those, and the whole numbers
and reals that they may be.
"""

import random
import re
import struct

NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
WORDS = (
    *(b"nan", b"-nan", b"inf", b"-inf", b"NaN", b"1e400", b"-1e400", b"1e308", b"1e-320"),
    *(b"-1", b"0", b"-0.0", b"1", b"2", b"3", b"0.5", b"1e5", b"4294967296", b"2147483648"),
    *(
        b"9007199254740993",
        b"9223372036854775808",
        b"99999999999999999999",
        b"0x10",
        b"1_0",
        b"1,5",
    ),
    *(
        b"",
        b"x",
        b"#",
        b'"',
        b"'",
        b"\\",
        b"<",
        b"]]>",
        b"\xff\x00",
        b"\0",
        b"\xc3",
        b"\xe2\x80\xa8",
    ),
    *(b"\r", b"\t", b";", b",", b"{}", b"[", b"ITEM:", b"None", b"true", b"1d3", b"\xd9\xa1"),
)
SIZES = (0, 1, 2, 3, 7, 8, 127, 128, 255, 256, 65535, 65536, 2**31 - 1, 2**31, 2**32 - 1)
LARGE = (2**32, 2**40, 2**62, 2**63, 2**64 - 1)
REALS = (float("nan"), float("inf"), -float("inf"), -1.0, 0.0, 1e300, -1e300, 5e-324, 2.0**53 + 2)
CODES = ("utf-16", "utf-8-sig", "utf-32", "cp1252", "utf-7")
LONGEST = 1 << 16  # bytes that a file grows to at most


def number(data: bytes, rng: random.Random) -> bytes:
    """Another number, or a word, in place of one."""
    found = list(NUMBER.finditer(data))
    if not found:
        return word(data, rng)
    one = rng.choice(found)
    new = rng.choice(WORDS)
    if rng.random() < 0.3 and one[0].isdigit():
        new = str(int(one[0][:18]) + rng.choice((-1, 1, 1000))).encode()
    return data[: one.start()] + new + data[one.end() :]


def word(data: bytes, rng: random.Random) -> bytes:
    """A word of a line lost, doubled, moved, or another."""
    rows = data.split(b"\n")
    k = rng.randrange(len(rows))
    words = re.split(rb"([ ,;\t]+)", rows[k])
    i = rng.randrange(len(words))
    how = rng.randrange(4)
    if how == 0:
        del words[i]
    elif how == 1:
        words.insert(i, words[i])
    elif how == 2:
        words[i] = rng.choice(WORDS)
    else:
        words.insert(rng.randrange(len(words)), rng.choice(words))
    rows[k] = b"".join(words)
    return b"\n".join(rows)


def line(data: bytes, rng: random.Random) -> bytes:
    """A line lost, doubled, moved, blank, joined with the next, or very long."""
    rows = data.split(b"\n")
    k = rng.randrange(len(rows))
    how = rng.randrange(6)
    if how == 0:
        del rows[k]
    elif how == 1:
        rows.insert(k, rows[k])
    elif how == 2:
        rows.insert(rng.randrange(len(rows)), rows.pop(k))
    elif how == 3:
        rows[k] = rng.choice((b"", b" ", b"\r", b"# a remark"))
    elif how == 4 and k + 1 < len(rows):
        rows[k : k + 2] = [rows[k] + rows[k + 1]]
    else:
        rows[k] = rows[k] * rng.choice((2, 3, 50))
    return b"\n".join(rows)


def cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def octets(data: bytes, rng: random.Random) -> bytes:
    """A few bytes changed, lost, put in, or moved."""
    at = rng.randrange(len(data) + 1)
    size = rng.choice((1, 1, 1, 2, 4, 8, 64))
    how = rng.randrange(5)
    if how == 0 and at < len(data):
        return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]
    if how == 1:
        return data[:at] + rng.randbytes(size) + data[at + size :]
    if how == 2:
        return data[:at] + data[at + size :]
    if how == 3:
        return data[:at] + rng.randbytes(size) + data[at:]
    other = rng.randrange(len(data) + 1)
    return data[:at] + data[other : other + size] + data[at:]


def whole(data: bytes, rng: random.Random) -> bytes:
    """A whole number or a real of some width, at a place that is often a multiple of four."""
    at = rng.randrange(len(data) + 1)
    at -= at % 4 if rng.random() < 0.7 else 0
    form = rng.choice("BHIQfd")
    value: float = rng.choice(SIZES + LARGE)
    if form in "fd":
        value = rng.choice(REALS)
        value = max(-3e38, min(3e38, value)) if form == "f" and abs(value) < 1e301 else value
    else:
        value = int(value) % 2 ** (8 * struct.calcsize(form))
    new = struct.pack(rng.choice("<>") + form, value)
    return data[:at] + new + data[at + len(new) :]


def encoded(data: bytes, rng: random.Random) -> bytes:
    """In another encoding, or with other ends of lines."""
    how = rng.randrange(4)
    if how == 0:
        return data.replace(b"\n", rng.choice((b"\r\n", b"\r", b"\n\n", b"\x0b", b"\x85")))
    if how == 1:
        return data.decode("latin-1").encode(rng.choice(CODES), "replace")
    return data.replace(b" ", rng.choice((b"\t", b"  ", b"\xa0", b",", b"\0")), rng.choice((1, -1)))


TEXT = (number, number, number, number, word, word, line, line, cut, octets, octets, encoded)
BYTES = (octets, octets, octets, whole, whole, whole, cut)


def mutated(data: bytes, rng: random.Random, text: bool) -> bytes:
    """`data` with one to four things changed."""
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 4))):
        data = rng.choice(TEXT if text else BYTES)(data, rng)[:LONGEST]
    return data
