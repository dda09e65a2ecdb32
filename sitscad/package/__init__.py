"""Behind `build`, `verify` and `new`: the only package of sitscad that writes files.

`building` sees whether anything has to be done, `stages` decides what is made and what can be kept, `folder` writes a
package so that it is replaced as a whole or not at all, and a file alone, `manifest` says what is in it and from what
it was made, `verification` reads one back, and `template` hands out the example specs. Only `folder` and `template`
touch the disk for writing.
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
