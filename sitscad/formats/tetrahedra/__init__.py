"""Meshes of tetrahedra by gmsh: the pad alone for mechanics, and coils, metal, pad and air for fields."""
