"""A model's C as WebAssembly, compiled by ziglang's clang; the cache keeps what was made."""

import hashlib
import sys
from importlib.metadata import version
from pathlib import Path

from ...basics.errors import CompileFailed
from ...basics.extras import needed
from ...basics.progress import Stage
from ...compiling.cache import LIBRARIES, alone, cache_folder, digest, find, store, workshop
from ...compiling.toolchain import run_command
from ...model.library import LAZY_SOURCES
from ...model.manifest import CheckedFolder

HEADERS = Path(__file__).with_name("native")  # in place of a C library
# Without contraction and with all checks of numbers, as in the profile "reproducible"; only what
# is exported stays.
FLAGS = (
    *("-target", "wasm32-freestanding", "-std=c99", "-O2", "-msimd128", "-mbulk-memory"),
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-ffunction-sections"),
    *("-nostdlib", "-Wl,--no-entry", "-Wl,--gc-sections", "-Wl,--strip-all"),
    "-Wl,--export=__heap_base",
)


def webassembly(checked: CheckedFolder, exports: list[str]) -> bytes:
    """Return the WebAssembly module of a model's C with these functions.

    ExtraMissing without ziglang, CompileFailed if it refuses the C, SerpentailError about the
    cache.
    """
    needed("ziglang", "live")
    prefix = checked.manifest["prefix"]
    late = {f"src/{prefix}_{part}.c" for part in LAZY_SOURCES}
    names = [name for name in checked.files if name.endswith((".c", ".h")) and name not in late]
    texts = {name: checked.files[name] for name in names if not name.startswith("example/")}
    texts |= {f"libc/{path.name}": path.read_bytes() for path in sorted(HEADERS.iterdir())}
    flags = [*FLAGS, *(f"-Wl,--export={name}" for name in exports)]
    digests = [(name, hashlib.sha256(text).hexdigest()) for name, text in sorted(texts.items())]
    cache, key = cache_folder(), digest([digests, flags, version("ziglang")])
    with alone(cache, key):
        found = find(cache, LIBRARIES, key)
        return found[1] if found else _compiled(texts, flags, cache, key)


def _compiled(texts: dict[str, bytes], flags: list[str], cache: Path, key: str) -> bytes:
    """Return the module of texts, which the cache then has."""
    with workshop(cache) as part, Stage("compile", "WebAssembly"):
        for name, text in texts.items():
            path = part / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
        sources = [str(part / name) for name in texts if name.endswith(".c")]
        folders = ("-isystem", str(part / "libc"), "-I", str(part / "include"))
        made = part / "module.wasm"
        command = (sys.executable, "-m", "ziglang", "cc", *flags, *folders, *sources, "-o", made)
        finished = run_command([str(word) for word in command])
        if finished.returncode:
            words = finished.stderr.replace(str(part), "").strip()
            raise CompileFailed(f"ziglang could not make WebAssembly of the model: {words:.2000}")
        return store(cache, LIBRARIES, key, made).read_bytes()
