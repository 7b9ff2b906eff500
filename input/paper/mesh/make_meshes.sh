#!/bin/sh
# Makes the mesh files of the paper's decks again: sh make_meshes.sh   (Gmsh 4.8.4 made the ones that are shipped)
# or one of another size:                          sh make_meshes.sh three_point_bending|uniaxial_compression H
#
# Gmsh's export is kept but for three things: line elements go (the decks need none), elements count from 1, and
# coordinates are written with 10 significant digits (1e-17 on a straight side becomes 0). A centre x,y takes the
# element nearest to it out of the set ROCK and into the set CENTRE, so that a deck can give it a weaker material.
set -eu
cd "$(dirname "$0")"
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

mesh() { # name, h, [centre x, centre y]
   gmsh -2 -v 2 -nt 1 -setnumber h "$2" -format inp "$1.geo" -o "$scratch/mesh.inp"
   awk -F '[, ]+' -v name="$1" -v h="$2" -v xc="${3:-none}" -v yc="${4:-none}" '
      function tidy(value) { return sprintf("%.10g", (value < 1e-9 && value > -1e-9) ? 0 : value) }
      /^\*/ { part = ""; if ($0 ~ /^\*NODE/) part = "node"; if ($0 ~ /type=CPS3/) part = "triangle"; next }
      part == "node" { n_nodes++; id[n_nodes] = $1; x[$1] = tidy($2); y[$1] = tidy($3) }
      part == "triangle" { n_elements++; a[n_elements] = $2; b[n_elements] = $3; c[n_elements] = $4 }
      END {
         if (xc != "none") {
            for (e = 1; e <= n_elements; e++) {
               dx = (x[a[e]] + x[b[e]] + x[c[e]])/3 - xc; dy = (y[a[e]] + y[b[e]] + y[c[e]])/3 - yc
               if (e == 1 || dx*dx + dy*dy < nearest) { nearest = dx*dx + dy*dy; centre = e }
            }
         }
         printf "** %s.geo, h = %s: %d nodes, %d triangles; made by make_meshes.sh\n", name, h, n_nodes, n_elements
         print "*NODE"
         for (i = 1; i <= n_nodes; i++) printf "%d,%s,%s\n", id[i], x[id[i]], y[id[i]]
         print "*ELEMENT, TYPE=CPS3, ELSET=ROCK"
         for (e = 1; e <= n_elements; e++) if (e != centre) printf "%d,%d,%d,%d\n", e, a[e], b[e], c[e]
         if (centre) {
            print "*ELEMENT, TYPE=CPS3, ELSET=CENTRE"
            printf "%d,%d,%d,%d\n", centre, a[centre], b[centre], c[centre]
         }
      }' "$scratch/mesh.inp" > "$1_h$2.inp"
   head -n 1 "$1_h$2.inp"
}

one() { # name, h
   case $1 in
      three_point_bending) mesh "$1" "$2" ;;
      uniaxial_compression) mesh "$1" "$2" 25 50 ;;
      *) echo "make_meshes.sh: no mesh $1 (three_point_bending, uniaxial_compression)" >&2; exit 2 ;;
   esac
}

case $# in
   0)
      for h in 8 4 2; do one three_point_bending "$h"; done
      for h in 5 4 3 2; do one uniaxial_compression "$h"; done ;;
   2) one "$1" "$2" ;;
   *) echo "usage: sh make_meshes.sh [NAME H]" >&2; exit 2 ;;
esac
