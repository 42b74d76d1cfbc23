"""Damaged copies of files: bytes flipped, cut, doubled or inserted, numbers made hostile."""

import random
import re
from collections.abc import Iterator

NUMBER = re.compile(rb"-?\d+(\.\d*)?")
HOSTILE = (
    *(
        b"nan",
        b"inf",
        b"-1",
        b"0",
        b"1e38",
        b"1e308",
        b"-1e999",
        b"1_0",
        b"9" * 5000,
        b"0x" + b"f" * 5000,
    ),
    *(
        b"",
        b" ",
        b'"',
        b"'",
        b"\0",
        b"\x1b[2J",
        b"\xff\xfe",
        "\u2028\u0661\u202e".encode(),
        b"\t",
        b",",
        b"\r",
    ),
    *(
        b"[" * 5000,
        b"{}",
        b"[]",
        b"[[]]",
        b"true",
        b"a." * 200,
        b"x" * 200_000,
        b"=cmd|' /C calc'!A0",
    ),
    *(b"1979-05-27", b'"3 kg"', b'"' + b"1" * 400 + b' mm"', b"%n%s", b"../../etc/passwd"),
)


def mutants(content: bytes, count: int, seed: int = 0) -> Iterator[bytes]:
    """Yield damaged copies, the same ones for a seed."""
    draw = random.Random(seed)
    text = b"\0" not in content
    ways = [_flipped, _set, _cut, _without, _doubled, _inserted] + 6 * [_hostile] * text
    for _ in range(count):
        found = content
        for _ in range(draw.choice((1, 1, 1, 2, 4))):
            found = draw.choice(ways)(found, draw)
        yield found


def _span(content, draw):
    """Two places, most often near each other."""
    begin = draw.randrange(len(content) + 1)
    return begin, min(len(content), begin + draw.choice((1, 4, 40, len(content))))


def _flipped(content, draw):
    place = draw.randrange(len(content) or 1)
    flipped = bytes([x ^ (1 << draw.randrange(8)) for x in content[place : place + 1]])
    return content[:place] + flipped + content[place + 1 :]


def _set(content, draw):
    place = draw.randrange(len(content) or 1)
    return content[:place] + draw.choice((b"\0", b"\x01", b"\x7f", b"\xff")) + content[place + 1 :]


def _cut(content, draw):
    place = draw.randrange(len(content) + 1)
    return draw.choice((content[:place], content[place:]))


def _without(content, draw):
    begin, end = _span(content, draw)
    return content[:begin] + content[end:]


def _doubled(content, draw):
    begin, end = _span(content, draw)
    return content[:end] + content[begin:end] * draw.choice((1, 1, 50)) + content[end:]


def _inserted(content, draw):
    place = draw.randrange(len(content) + 1)
    return content[:place] + draw.randbytes(draw.choice((1, 8, 512))) + content[place:]


def _hostile(content, draw):
    """Put a hostile token in place of a number or of a word, or anywhere."""
    where = draw.choice((NUMBER, re.compile(rb"\w+"), re.compile(rb"")))
    places = [found.span() for found in where.finditer(content)]
    begin, end = draw.choice(places) if places else (0, 0)
    return content[:begin] + draw.choice(HOSTILE) + content[end:]
