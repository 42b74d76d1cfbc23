"""A model's C as WebAssembly, compiled by ziglang's clang; the cache keeps what was made."""

import sys
from importlib.metadata import version
from pathlib import Path

from ...basics.errors import CompileFailed
from ...basics.extras import needed
from ...compiling.cache import LIBRARIES, cache_folder, digest, find, store, workshop
from ...compiling.toolchain import run_command
from ...model.library import LAZY_SOURCES
from ...model.manifest import CheckedFolder

HEADERS = Path(__file__).with_name("native")  # in place of a C library
# no contraction, as in the profile "reproducible"; of the C only what is exported stays
FLAGS = (
    *("-target", "wasm32-freestanding", "-std=c99", "-O2", "-msimd128", "-mbulk-memory"),
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-ffunction-sections"),
    *("-nostdlib", "-Wl,--no-entry", "-Wl,--gc-sections", "-Wl,--strip-all"),
)


def webassembly(checked: CheckedFolder, exports: list[str]) -> bytes:
    """Return the WebAssembly module of a model's C with these functions.

    ExtraMissing without ziglang, CompileFailed if it refuses the C, SerpentailError about the
    cache.
    """
    needed("ziglang", "live")
    late = {f"src/{checked.manifest['prefix']}_{part}.c" for part in LAZY_SOURCES}
    texts = {name: text for name, text in checked.files.items() if name not in late}
    texts = {name: text for name, text in texts.items() if name.startswith(("src/", "include/"))}
    texts |= {f"libc/{path.name}": path.read_bytes() for path in sorted(HEADERS.iterdir())}
    flags = [*FLAGS, *(f"-Wl,--export={name}" for name in ("__heap_base", *exports))]
    told = [(name, text.decode()) for name, text in sorted(texts.items())]
    cache, key = cache_folder(), digest([told, flags, version("ziglang")])
    if found := find(cache, LIBRARIES, key):
        return found[1]
    with workshop(cache) as part:
        for name, text in texts.items():
            (part / name).parent.mkdir(exist_ok=True)
            (part / name).write_bytes(text)
        command = [sys.executable, "-m", "ziglang", "cc", *flags, "-o", f"{part}/module.wasm"]
        command += [f"-isystem{part}/libc", f"-I{part}/include"]
        finished = run_command([*command, *(f"{part}/{name}" for name in texts if name[-1] == "c")])
        if finished.returncode:
            words = finished.stderr.replace(f"{part}/", "")
            raise CompileFailed(f"ziglang could not make WebAssembly of the model: {words:.2000}")
        return store(cache, LIBRARIES, key, part / "module.wasm").read_bytes()
