"""The functions without checks: the same numbers, and no promise."""

import pytest

from ...support.models import model_folder
from ..target.emitted import C99, run

MAIN = """#include "@_unchecked.h"
#include <math.h>
#include <string.h>

int main(void)
{
  @_real q[@@_NQ] = { 0 }, v[@@_NV] = { 0 }, tau[@@_NT] = { 0 }, one[@@_NV], other[@@_NV];
  @_real work[@@_WORK_FORWARD_DYNAMICS + 1];
  @_parameters p;
  @_default_parameters(&p);
  q[3] = 1;
  q[7] = v[4] = (@_real)0.5;
  int wrong = @_forward_dynamics(&p, q, v, tau, one, work) != @@_OK;
  wrong += @_unchecked_forward_dynamics(&p, q, v, tau, other, work) != @@_OK;
  wrong += memcmp(one, other, sizeof one) != 0;
  tau[0] = (@_real)NAN;
  wrong += @_forward_dynamics(&p, q, v, tau, one, work) != @@_NOT_FINITE;
  wrong += @_unchecked_forward_dynamics(&p, q, v, tau, other, work) != @@_OK;
  return wrong;
}
"""


@pytest.mark.parametrize("emission", ["straight", "loops"])
def test_unchecked_functions_compute_the_same_and_promise_nothing(tmp_path, emission):
    folder = model_folder(1, 1, name="bare", functions=["forward_dynamics"], emission=emission)
    main, program = tmp_path / "main.c", tmp_path / "main"
    main.write_text(MAIN.replace("@@", "BARE").replace("@", "bare"))
    source, include = folder / "src" / "bare.c", folder / "include"
    run("gcc", *C99, "-I", include, main, source, "-o", program, "-lm")
    run(program)
