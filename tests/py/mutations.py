"""Files with something wrong in them: a reader says so in one line, or reads what is there."""

import random

from cases.errors import CaseError

WORDS = (
    b"nan",
    b"inf",
    b"-1",
    b"1e400",
    b"x",
    b"",
    b"#",
    b"\xff\x00",
    b"99999999999999999999",
    b'"',
)


def mutated(data: bytes, seed: int) -> bytes:
    """`data` with a few words replaced, doubled or lost, or cut short."""
    rng = random.Random(seed)
    lines = data.split(b"\n")
    for _ in range(rng.randint(1, 3)):
        k = rng.randrange(len(lines))
        words = lines[k].split(b" ")
        what = rng.randrange(5)
        if what == 0:
            words[rng.randrange(len(words))] = rng.choice(WORDS)
        elif what == 1:
            del words[rng.randrange(len(words))]
        elif what == 2:
            lines.insert(k, lines[k])
        elif what == 3:
            words.append(rng.choice(WORDS))
        lines[k] = b" ".join(words)
        if what == 4:
            text = b"\n".join(lines)
            lines = text[: rng.randrange(1, len(text) + 1)].split(b"\n")
    return b"\n".join(lines)


def read_or_refused(reader, path, options=None):
    """The frames, or None where they were refused in one line that names the file."""
    try:
        frames = list(reader.frames(path, dict(options or {})))
    except CaseError as error:
        assert str(path) in str(error) and "\n" not in str(error), error
        return None
    for frame in frames:
        for table in (frame.columns, frame.contacts or {}):
            assert len({len(values) for values in table.values()}) <= 1
            assert all(values.dtype.kind in "iuf" for values in table.values())
    return frames
