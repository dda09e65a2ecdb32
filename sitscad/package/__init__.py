"""Behind `build`, `verify` and `new`: the only package of sitscad that writes files.

`building` decides whether a build is needed. `stages` makes files or keeps old ones. `replacing` exchanges a whole
package for the old one. `folder` writes single files and copies example specs. `manifest` lists the files of a package
and their inputs. `verification` reads a package back.
"""

from __future__ import annotations

from sitscad.files.writer import STAGES
from sitscad.package.building import build, require_distinct_names, stale
from sitscad.package.folder import (
    PackageError,
    list_templates,
    profile_lines,
    write_file,
    write_schema,
    write_study,
    write_template,
)
from sitscad.package.manifest import BuildResult, StageResult
from sitscad.package.verification import Verification, verify

__all__ = [
    "STAGES",
    "BuildResult",
    "PackageError",
    "StageResult",
    "Verification",
    "build",
    "list_templates",
    "profile_lines",
    "require_distinct_names",
    "stale",
    "verify",
    "write_file",
    "write_schema",
    "write_study",
    "write_template",
]
