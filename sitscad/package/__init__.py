"""The folder of a package: the only wing of sitscad that writes files.

`building` decides whether a build is needed. `stages` makes files or keeps old ones. `folder` writes single files and
copies example specs. `manifest` lists the files of a package and their inputs. `verification` reads a package back.
`inspection` checks one file as a path leads to it; `plugins` puts rules and writers from outside in force.
"""
