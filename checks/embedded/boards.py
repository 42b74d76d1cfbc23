"""The boards of the check: how to build for each and how to run what was built."""

import shutil
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
SEMIHOSTING = ("-display", "none", "-monitor", "none", "-serial", "none")
SEMIHOSTING += ("-chardev", "stdio,id=out")
SEMIHOSTING += ("-semihosting-config", "enable=on,target=native,chardev=out")
COUNTED = (*SEMIHOSTING, "-icount", "shift=0", "-kernel")  # an instruction takes 1 ns
WARNINGS = ("-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow")
WARNINGS += ("-Werror",)
# Flags as in the runtime's profiles; `fast` lets the compiler fuse a * b + c.
PROFILES = {
    "fast": ("-O2", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math"),
    "reproducible": ("-O2", "-ffp-contract=off"),
}


class ToolchainMissing(RuntimeError):
    """A compiler or an emulator is not installed; the message says how to install it."""


@dataclass(frozen=True)
class Board:
    """One machine: its compiler and flags, its sources here, how to link and run, and what to
    install.
    """

    name: str
    title: str
    real: str  # type that its FPU computes
    compiler: str
    cpu: tuple[str, ...]
    port: str
    link: tuple[str, ...]
    emulator: tuple[str, ...]
    packages: tuple[str, ...]

    def need(self) -> None:
        """Raise ToolchainMissing unless compiler and emulator are on PATH."""
        programs = self.compiler, *self.emulator[:1]
        absent = [program for program in programs if shutil.which(program) is None]
        if absent:
            raise ToolchainMissing(
                f"{self.name}: {' and '.join(absent)} not on PATH; Debian, Ubuntu: "
                f"apt-get install --no-install-recommends {' '.join(self.packages)}"
            )


def cortex(name: str, title: str, real: str, machine: str, fpu: str) -> Board:
    """Return a Cortex-M of QEMU's mps2 boards, whose SysTick counts nanoseconds."""
    cpu = ("-mthumb", f"-mcpu=cortex-{name}", f"-mfpu={fpu}", "-mfloat-abi=hard")
    emulator = ("qemu-system-arm", "-M", machine, *COUNTED)
    packages = ("gcc-arm-none-eabi", "libnewlib-arm-none-eabi", "qemu-system-arm")
    link = ("-nostartfiles", "-T", "arm.ld")
    return Board(name, title, real, "arm-none-eabi-gcc", cpu, "arm.c", link, emulator, packages)


def riscv() -> Board:
    """Return the 32-bit RISC-V of QEMU's virt board."""
    compiler, link = "riscv64-unknown-elf-gcc", ("-nostartfiles", "-T", "riscv.ld")
    cpu = ("--specs=picolibc.specs", "-march=rv32imafdc", "-mabi=ilp32d", "-mcmodel=medany")
    emulator = ("qemu-system-riscv32", "-M", "virt", "-bios", "none", *COUNTED)
    packages = ("gcc-riscv64-unknown-elf", "picolibc-riscv64-unknown-elf", "qemu-system-misc")
    own = compiler, cpu, "riscv.c", link, emulator, packages
    return Board("rv32", "RV32GC", "double", *own)


BOARDS = {
    board.name: board
    for board in (
        cortex("m4", "Cortex-M4F", "float", "mps2-an386", "fpv4-sp-d16"),
        cortex("m7", "Cortex-M7", "double", "mps2-an500", "fpv5-d16"),
        riscv(),
        Board("host", "host", "double", "gcc", (), "host.c", (), (), ("gcc",)),
    )
}
