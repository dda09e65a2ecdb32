"""Package folders: when to build, and how to write and verify them. All files are written by this subpackage.

`building` decides whether a build is needed. `stages` makes files or reuses files of the last build. `folder` writes
single files and copies example specs. `manifest` lists the files of a package and their inputs. `verification` reads a
package back. `inspection` checks a single file, whose package it finds from its path. `plugins` adds rules and writers
from outside.
"""
