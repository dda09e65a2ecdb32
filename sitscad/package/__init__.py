"""Package folders: the files of one sensor, their build from its spec, and their verification.

A package holds all production files and documents of a sensor. `building` decides whether a build is needed. `stages`
makes files or reuses files of the last build. `folder` writes single files and `example_specs` copies example specs.
`manifest` lists the files of a package and their inputs. `verification` compares a package with its manifest.
`inspection` checks a single spec file. `plugins` adds rules and writers from outside.
"""
