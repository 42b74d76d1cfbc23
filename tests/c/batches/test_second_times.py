"""States in lanes that fail are evaluated again, one by one: sound states never are."""

import numpy as np
import pytest

import serpentail as st
from serpentail.model.batch import MIN_BATCH
from serpentail.model.kernel import Kernel
from tests.support.models import model_folder

MODELS = {
    "links": (2, 1, {"functions": "all"}),
    "arcs": (1, None, {"functions": "all"}),
    "ground": (1, 3, {"functions": "all", "contacts": ["feet", "tail", "torso"]}),
    "float": (2, 1, {"real": "float"}),
}


@pytest.mark.parametrize("name", MODELS)
def test_sound_states_are_evaluated_once(name, monkeypatch):
    segments, links, options = MODELS[name]
    model, rng = st.load(model_folder(segments, links, **options)), np.random.default_rng(7)
    monkeypatch.setattr(Kernel, "_each", lambda *_: pytest.fail("one by one"))
    for function in model.batch_library.work:
        entry = model.manifest["functions"][function]
        shapes = [tuple(port["shape"]) for port in entry["inputs"]]
        given = [rng.uniform(-1, 1, (MIN_BATCH + 3, *shape)) for shape in shapes]
        given[0][:, 2] += 9.0  # clear of the ground
        outputs = model.kernel(function)(*given)
        for output in outputs if isinstance(outputs, tuple) else (outputs,):
            assert np.isfinite(output).all()
