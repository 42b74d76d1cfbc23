"""Flash of one function of a model: its code and constants, with all that it calls."""

from checks.embedded.image import Image, command


def flash(image: Image, name: str) -> int:
    """Return bytes of code and constants of one function with all that it calls, without libc."""
    prefix, board = image.manifest["prefix"], image.board
    alone = image.path.with_name(f"{name}.elf")
    options = [
        "-nostdlib",
        "-Wl,--gc-sections",
        f"-Wl,-e,{prefix}_{name}",
        "-Wl,--unresolved-symbols=ignore-all",
    ]
    source = str(image.path.with_name(f"{prefix}.o"))
    command([board.compiler, *board.cpu, *options, source, "-o", str(alone)])
    size = board.compiler.replace("gcc", "size")
    return int(command([size, str(alone)]).splitlines()[1].split()[0])
