"""A run as on a lesser processor: NumPy and the models' machine code keep to its instructions."""

import platform
import subprocess
import sys
from pathlib import Path

import pytest

AS_ON = Path(__file__).parents[1] / "support" / "as_on.py"
# prints what NumPy may still choose, and what a compiled model may use
QUESTION = '''
import ctypes, sys
from pathlib import Path
import numpy as np
from serpentail.model.compiler import compile_library
folder = Path(sys.argv[1])
source = folder / "asked.c"
source.write_text("""
int asked(void) {
#if defined(__AVX512F__)
  return 512;
#elif defined(__AVX2__)
  return 256;
#else
  return 128;
#endif
}
""")
library = ctypes.CDLL(str(compile_library([source], folder, cache=folder / "cache")))
kernels = np.show_config(mode="dicts")["SIMD Extensions"].get("found", ())
print(library.asked(), *kernels)
'''


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="levels of x86-64")
@pytest.mark.parametrize(("level", "bits"), [("x86-64-v3", "256"), ("x86-64-v2", "128")])
def test_a_lesser_processor_lends_its_instructions_only(level, bits, tmp_path):
    command = [sys.executable, AS_ON, level, sys.executable, "-c", QUESTION, tmp_path]
    answer = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert answer[0] == bits
    beyond = ("AVX512", "X86_V4", *(["AVX2", "FMA3", "X86_V3"] if bits == "128" else []))
    assert not [name for name in answer[1:] if name.startswith(beyond)]
