"""Damaged copies of files: bytes flipped, cut, doubled or inserted, numbers made hostile."""

import random
import re
from collections.abc import Iterator

NUMBER, WORD, ANYWHERE = (re.compile(each) for each in (rb"-?\d+(\.\d*)?", rb"\w+", rb""))
LONG = (b"9" * 5000, b"0x" + b"f" * 5000, b"[" * 5000, b"a." * 200, b"x" * 200_000)
HOSTILE = (
    *(b"nan", b"inf", b"-1", b"0", b"1e38", b"1e308", b"-1e999", b"1_0", b"true", b"1979-05-27"),
    *(b"", b" ", b'"', b"'", b"\t", b",", b"\r", b"\0", b"\x1b[2J", b"\xff\xfe", b"\xe2\x80\xa8"),
    *(b"=", b"[[", b"'''", b"\\", b"#", b"\n", b"\xef\xbb\xbf", b"-0.0", b"1e-320", b"[nan]"),
    *(b'"all"', b'"continuum"', b'"polar"', b'"float"', b"[plan]", b"[simulate]", b"[parameters]"),
    *(b"{}", b"[]", b"[[]]", b'"3 kg"', b"=cmd|' /C calc'!A0", b"%n%s", b"../../etc/passwd"),
)


def mutants(content: bytes, count: int, seed: int = 0) -> Iterator[bytes]:
    """Yield damaged copies, the same ones for a seed; in texts half of the changes are tokens."""
    draw, text = random.Random(seed), b"\0" not in content
    for _ in range(count):
        found = content
        for _ in range(draw.choice((1, 1, 1, 2, 4))):
            found = (_hostile if text and draw.random() < 0.5 else _damaged)(found, draw)
        yield found


def _damaged(content, draw):
    """Replace some bytes: by one flipped or set, by none, by copies, or with more in front."""
    begin = draw.randrange(len(content) + 1)
    end = min(len(content), begin + draw.choice((1, 1, 4, 40, len(content))))
    old = content[begin:end]
    ways = (
        bytes([x ^ (1 << draw.randrange(8)) for x in old[:1]]) + old[1:],
        draw.choice((b"\0", b"\x01", b"\x7f", b"\xff")) + old[1:],
        b"",
        old[:4000] * draw.choice((2, 2, 50)),
        draw.randbytes(draw.choice((1, 8, 512))) + old,
    )
    return content[:begin] + draw.choice(ways) + content[end:]


def _hostile(content, draw):
    """Put a token in place of a number or of a word, or anywhere."""
    places = [found.span() for found in draw.choice((NUMBER, WORD, ANYWHERE)).finditer(content)]
    begin, end = draw.choice(places) if places else (0, 0)
    return content[:begin] + draw.choice(draw.choice((HOSTILE, HOSTILE, LONG))) + content[end:]
