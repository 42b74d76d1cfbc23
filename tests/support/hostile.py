"""Names that a scene may not have, and files that are not scenes, for both packages."""

import os
from pathlib import Path

NAMES = (
    "", " ", ".", "..", "/", "../elsewhere/t", "a/b", "/etc/t", "a\\b", "C:t", "~", "-t",
    "--output", "_t", "1t", "T", "tA", "t-1", "t.1", "t t", "t\n", "\nt", "t\0", "t;ls", "$(ls)",
    "t\u0131", "\uff54", "math", "stdio", "float", "a" * 64, "a" * 240, "a" * 100_000,
    3, 0, True, 1.5, [], ["t"], {}, {"t": 1},
)  # fmt: skip
GOOD_NAMES = ("t", "math_", "float1", "t1", "a_b", "a" * 63, "kangaroo_rat_m1_n3")


def unreadable(folder: Path) -> dict[str, Path]:
    """Make files from which no scene can be read, and return their paths by description."""
    texts = {
        "empty name": b"kind = ",
        "latin": b"kind = '\xff'",
        "large": b"#" * 1_000_001,
        "deep key": b"a." * 3000 + b"a = 1",
        "deep number": b"1.1 . " * 3000 + b"1 = 1",
        "deep header": b"[" + b"a." * 100_000 + b"a]",
        "deep quoted key": b'"=".' * 10_000 + b"a = 1",
        "deep array": b"a = " + b"[" * 100_000,
        "digits": b"a = " + b"9" * 100_000,
        "nul": b"a = 1\0",
    }
    paths = {name: folder / f"{name.replace(' ', '_')}.toml" for name in texts}
    for name, path in paths.items():
        path.write_bytes(texts[name])
    os.mkfifo(folder / "pipe.toml")
    (folder / "folder.toml").mkdir()
    (folder / "loop.toml").symlink_to(folder / "loop.toml")
    more = {name: folder / f"{name}.toml" for name in ("pipe", "folder", "loop", "absent")}
    more |= {"endless": Path("/dev/zero"), "null": Path("/dev/null")}
    return paths | more | {"nul in path": folder / "a\0.toml", "long": folder / ("a" * 5000)}
