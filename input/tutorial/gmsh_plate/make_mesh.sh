#!/bin/sh
# Makes both mesh files again: sh make_mesh.sh   (Gmsh 4.8.4 made the ones that are shipped)
set -eu
cd "$(dirname "$0")"
# 1. What Gmsh exports, as it is: a heading, line elements on the physical curves, plane-stress triangles.
gmsh -2 -v 2 -nt 1 -format inp plate.geo -o plate_exported.inp
# 2. For CalculiX and plane strain: no heading (a deck may have one only), no line elements (they would need a
#    section), CPE3 for CPS3.
awk '/^\*/ { left_out = ($0 ~ /Heading|type=T3D2/) } !left_out { sub(/type=CPS3/, "type=CPE3"); print }' \
   plate_exported.inp > plate_plane_strain.inp
