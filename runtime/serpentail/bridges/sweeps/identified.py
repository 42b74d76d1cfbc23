"""Runs the identification of one point of a sweep."""

import warnings
from typing import TYPE_CHECKING, Any

from ...model.model import Model
from ...scenes.file import size_of
from ...scenes.identify import identify_arguments
from ...scenes.overrides import changed
from .axes import Point
from .job import DATA, Job
from .recordings import recordings

if TYPE_CHECKING:
    from ...identification.result import Identification


def identified(job: Job, model: Model, point: Point) -> tuple[dict[str, Any], "Identification"]:
    """Return the report of an identification, with what it warned of, and the identification."""
    from ...identification.identify import identify

    own = model.with_parameters(**job.own_parameters(point))
    keys = job.own_keys(point)
    keys.pop(DATA, None)
    if job.table is not None:
        arguments = identify_arguments(changed(job.table, keys), size_of(own)) | job.settings
    else:
        arguments = job.settings | keys
    arguments.pop(DATA, None)
    markers, estimate = arguments.pop("markers"), arguments.pop("estimate", ())
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = identify(own, recordings(job, point), markers, estimate, **arguments)
    report = found.report
    del report["seconds"]  # which each row has
    return report | {"warnings": [str(each.message) for each in told]}, found
