"""Behind `build`, `verify` and `new`: the only package of sitscad that writes files.

`building` decides whether anything has to be done, `stages` what is made and what can be kept, `replacing` lets a whole
package take the place of the one before, `folder` writes one file alone and hands out the example specs, `manifest`
says what is in a package and what it was made from, `verification` reads a package back.
"""

from __future__ import annotations

from sitscad.package.building import build, require_distinct_names, stale
from sitscad.package.folder import (
    PackageError,
    list_templates,
    write_file,
    write_schema,
    write_study,
    write_template,
)
from sitscad.package.manifest import BuildResult, StageResult
from sitscad.package.verification import Verification, verify
from sitscad.writer import STAGES

__all__ = [
    "STAGES",
    "BuildResult",
    "PackageError",
    "StageResult",
    "Verification",
    "build",
    "list_templates",
    "require_distinct_names",
    "stale",
    "verify",
    "write_file",
    "write_schema",
    "write_study",
    "write_template",
]
