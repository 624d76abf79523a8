#!/usr/bin/env bash
# demo.sh PROGRAM FOLDER [SIZE]: the main job of tetralod on a data set that is made on the spot.
set -euo pipefail
program=$(realpath "$1") folder=$2 size=${3:-}
mkdir -p "$folder"
cd "$folder"

step() { printf '\n$ tetralod %s\n' "$*"; "$program" "$@"; }

cat <<'TEXT'

The data: potential flow past a sphere, pressure and velocity in closed form, on a graded mesh of
tetrahedra around the hole that the sphere leaves.
TEXT
step sample sphere-flow -o sphere-flow.vtu ${size:+--size "$size"}
step info sphere-flow.vtu

printf '\nThe main job: the same flow with a tenth of the tetrahedra.\n'
step simplify sphere-flow.vtu -o sphere-flow-tenth.vtu --ratio 0.1

printf '\nThe proof: how far the two are apart, at every vertex of the original.\n'
step compare sphere-flow.vtu sphere-flow-tenth.vtu
"$program" compare sphere-flow.vtu sphere-flow-tenth.vtu --json > compare.json
"$program" info sphere-flow.vtu --json > info.json
"$program" info sphere-flow-tenth.vtu --json > info-tenth.json

# number FILE KEY: the first number of that key in one of our JSON files.
number() { tr -d ' \n' < "$1" | sed -n "s/.*\"$2\":\\[*\\([-0-9.e+]*\\).*/\\1/p"; }
tets=$(number info.json tets) tets_tenth=$(number info-tenth.json tets)
grouped() { sed ':again; s/\B[0-9]\{3\}\>/,&/; t again' <<< "$1"; }
mebibytes() { awk -v bytes="$(stat -c %s "$1")" 'BEGIN { printf "%.1f MiB", bytes / 1048576 }'; }

cat <<TEXT

What you have seen: $(grouped "$tets") tetrahedra became $(grouped "$tets_tenth"), and the file of $(mebibytes sphere-flow.vtu) became $(mebibytes sphere-flow-tenth.vtu).
"compare" measured the price: its lines "pressure" and "velocity" say how far the values of the small
mesh are from the original ones, as a root mean square and at the worst vertex, in percent of the
range; its line on the boundary says how far the surface of the sphere has moved at most.

Where it lies, in $PWD:
  sphere-flow.vtu         the original
  sphere-flow-tenth.vtu   a tenth of it
  compare.json            the comparison in numbers
To look at them: open both files in ParaView, press Apply, choose "pressure" in the colour menu and
the representation "Surface With Edges"; the filter Clip opens the view onto the sphere.
TEXT
