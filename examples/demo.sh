#!/usr/bin/env bash
# demo.sh PROGRAM FOLDER [SIZE [SHEET]]: the main job of tetralod on a data set that is made on the
# spot; SHEET, the program contact_sheet, puts pictures of it side by side.
set -euo pipefail
program=$(realpath "$1") folder=$2 size=${3:-} sheet=${4:+$(realpath "$4")}
pictures=$(realpath "$(dirname "$0")")/demo_pictures.sh view=$(realpath "$(dirname "$0")")/demo_view.sh
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

printf '\nAll of it at every level of detail, in one file; then meshes out of that file.\n'
step build sphere-flow.vtu -o sphere-flow.tlod
step extract sphere-flow.tlod -o flow-1-percent.vtu --error 1%
step extract sphere-flow.tlod -o flow-50000.vtu --tets 50000
step check sphere-flow.tlod --against sphere-flow.vtu

# row LABEL EXTRACT-OPTIONS MESH: what a mesh of the model costs, promises and keeps.
row() {
    local mesh=$3
    # shellcheck disable=SC2086
    "$program" extract sphere-flow.tlod -o "$mesh" $2 --json > extract.json
    "$program" compare sphere-flow.vtu "$mesh" --json > compare-model.json
    printf '%-14s %10s %11s %9.3f s %10.4f %10.4f\n' "$1" "$(grouped "$(number extract.json tets)")" \
        "$(mebibytes "$mesh")" "$(number extract.json seconds)" "$(of_pressure extract.json channel error)" \
        "$(of_pressure compare-model.json name max)"
}
# of_pressure FILE NAME-KEY KEY: a number of the pressure.
of_pressure() { tr -d ' \n' < "$1" | sed -n "s/.*\"$2\":\"pressure\"[^}]*\"$3\":\\([-0-9.e+]*\\).*/\\1/p"; }

printf '\n%-14s %10s %11s %11s %10s %10s\n' 'from the model' 'tets' 'file' 'extracted' 'promised' 'measured'
row 'at 1 %' '--error 1%' flow-1-percent.vtu
row '50,000 tets' '--tets 50000' flow-50000.vtu
row 'the finest' '--full' flow-full.vtu
printf '(largest error of the pressure at any vertex of the original)\n'
rm -f extract.json compare-model.json

if [[ -n $sheet ]]; then
    printf '\nPictures of the model, each off by at most a pixel (some 30 seconds) ...\n'
    "$pictures" "$program" "$sheet" .
    printf 'pictures.png has them side by side.\n'
fi

cat <<TEXT

What you have seen: $(grouped "$tets") tetrahedra became $(grouped "$tets_tenth"), and the file of $(mebibytes sphere-flow.vtu) became $(mebibytes sphere-flow-tenth.vtu).
"compare" measured the price: its lines "pressure" and "velocity" say how far the values of the small
mesh are from the original ones, as a root mean square and at the worst vertex, in percent of the
range; its line on the boundary says how far the surface of the sphere has moved at most.
"build" made a model of $(mebibytes sphere-flow.tlod) that holds the flow at all levels of detail; "extract" takes a mesh out
of it that fits together everywhere, for an error or a number of tetrahedra, and says what it promises.
"check" proved the file, and the promises at every vertex of the original.

Where it lies, in $PWD:
  sphere-flow.vtu         the original
  sphere-flow-tenth.vtu   a tenth of it
  sphere-flow.tlod        the model
  flow-1-percent.vtu      out of the model: errors of at most 1 % of the range
  flow-50000.vtu          out of the model: at most 50,000 tetrahedra
  compare.json            the comparison in numbers
${sheet:+  pictures.png            volume, surfaces, points, lines, patches and levels of the model
}To look at them: open the .vtu files in ParaView, press Apply, choose "pressure" in the colour menu and
the representation "Surface With Edges"; the filter Clip opens the view onto the sphere.
TEXT

if [[ -n $sheet ]]; then
    "$view" "$program" .
fi
