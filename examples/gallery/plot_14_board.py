"""
The same model on a microcontroller
===================================

A model is also a package of C for a microcontroller. It allocates no memory, keeps
no state and needs no library but ``libm``. Here we generate it in single precision,
look at the cost of each function, and run the generated example on this computer. It
needs a C compiler, ``cc``.
"""

import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import serpentail as st

names = ["tail_points", "energy", "mass_matrix", "inverse_dynamics", "forward_dynamics"]
sizes = {"1 x 3 links": (1, 3), "3 x 4 links": (3, 4)}
models = {
    size: st.build(tail="articulated", segments=m, links=n, real="float", functions=names)
    for size, (m, n) in sizes.items()
}
rat = models["1 x 3 links"]
for path in sorted(rat.folder.rglob("*.[ch]")):
    print(path.relative_to(rat.folder))

# %%
# An operation is an addition, a multiplication or a division. On a Cortex-M with an FPU
# for ``float``, gcc 12 makes 1 to 4 instructions of an operation.

plt.style.use("seaborn-v0_8-colorblind")
figure, ax = plt.subplots(figsize=(7, 3.4), layout="constrained")
for k, (size, model) in enumerate(models.items()):
    counts = [model.manifest["functions"][name]["operations"] for name in names]
    bars = ax.barh(np.arange(5) + 0.2 - 0.4 * k, counts, 0.38, label=size)
    ax.bar_label(bars, padding=3)
ax.set_yticks(range(5), names)
ax.set(xlabel="operations of one call", title="Forward dynamics costs thousands of operations")
ax.margins(x=0.12)
ax.legend()
plt.show()

# %%
# The example program of the package calls forward dynamics once. It is C99, and
# compiles without a warning. Python calls the same C.

here = Path(tempfile.mkdtemp())
sources = [rat.folder / "example/main.c", rat.folder / f"src/{rat.name}.c"]
flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", f"-I{rat.folder}/include"]
subprocess.run(["cc", *flags, *sources, "-lm", "-o", here / "example"], check=True)
print(subprocess.run([here / "example"], capture_output=True, text=True, check=True).stdout)
print("Python:", rat.forward_dynamics([0, 0, 0, 1, 0, 0, 0, 0.5, 0], np.zeros(8), np.zeros(2)))
