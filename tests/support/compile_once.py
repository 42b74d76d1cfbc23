"""Compiles the files of tests, each once for all tests, processes and runs."""

import json
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.support.models import BUILD, digest


def compile_once(name: str, command: Sequence[str], sources: Sequence[Path], include: Path) -> Path:
    """Return the file that ``command sources -o name`` makes; the compiler must print nothing."""
    files = [*sources, *sorted(include.rglob("*.h"))]
    compiler = Path(shutil.which(command[0]) or command[0]).resolve()
    texts = [(path.name, digest(path.read_text())) for path in files]
    key = digest(json.dumps([name, command, str(compiler), compiler.stat().st_mtime, texts]))
    place = BUILD / "objects" / key
    if not place.exists():
        place.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=place.parent, prefix=".") as temporary:
            own = Path(temporary) / "made"
            own.mkdir()
            words = [*command, "-I", str(include), *map(str, sources), "-o", str(own / name), "-lm"]
            done = subprocess.run(words, capture_output=True, text=True, check=False)
            said = done.stdout + done.stderr
            assert (done.returncode, said) == (0, ""), f"{shlex.join(words)}\n{said}"
            try:
                own.rename(place)
            except OSError:
                if not place.exists():
                    raise
    return place / name
