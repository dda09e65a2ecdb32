"""The folder of a package. Only this wing of sitscad writes files.

`building` decides whether a build is needed. `stages` makes files or keeps old ones. `folder` writes single files and
copies example specs. `manifest` lists the files of a package and their inputs. `verification` reads a package back.
`inspection` checks one file that a path leads to. `plugins` adds rules and writers from outside.
"""
