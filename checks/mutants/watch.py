"""A plugin of pytest that judges a mutant: runs the chosen tests, notes that the mutant's text was
loaded, and what noticed it.
"""

import faulthandler
import json
import os
from pathlib import Path

from jinja2 import PackageLoader

ORDERS = json.loads(Path(os.environ["SERPENTAIL_MUTANT"]).read_text())
WITNESS, VERDICT = Path(ORDERS["witness"]), Path(ORDERS["verdict"])
OUTPUT = os.dup(2)  # which pytest captures from now on
get_source = PackageLoader.get_source


def watched(loader, environment, template):
    """Load a template; if it is the mutant, note that it was loaded."""
    found = get_source(loader, environment, template)
    if ORDERS["mark"] in found[0]:
        WITNESS.touch()
    return found


PackageLoader.get_source = watched


def pytest_collection_modifyitems(config, items):
    """Keep the chosen tests; of a file none of whose tests is known any more, all."""
    chosen = set(ORDERS["tests"])
    known = {item.nodeid.split("::")[0] for item in items if item.nodeid in chosen}
    kept = [i for i in items if i.nodeid in chosen or i.nodeid.split("::")[0] not in known]
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = kept


def pytest_runtest_logstart():
    """End the process if its next test computes for ever in C, where no signal ends it."""
    faulthandler.dump_traceback_later(ORDERS["most"], exit=True, file=OUTPUT)


def pytest_runtest_logreport(report):
    """Keep the first failure."""
    if report.failed and not VERDICT.exists():
        crash = getattr(report.longrepr, "reprcrash", None)
        words = crash.message if crash else str(report.longrepr)
        VERDICT.write_text(json.dumps({"by": report.nodeid, "words": words[:300]}))


def pytest_collectreport(report):
    """Count a file of tests that cannot be imported as one that noticed the mutant."""
    if report.failed and not VERDICT.exists():
        words = {"by": report.nodeid, "words": str(report.longrepr)[-300:]}
        VERDICT.write_text(json.dumps(words))
