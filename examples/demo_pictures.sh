#!/usr/bin/env bash
# demo_pictures.sh PROGRAM SHEET FOLDER: pictures of sphere-flow.tlod in FOLDER, and all on one sheet.
set -euo pipefail
program=$(realpath "$1") sheet=$(realpath "$2")
cd "$3"

near=(--clip "x>-4" --clip "x<4" --clip "y>-3" --clip "y<3" --clip "z>-3" --clip "z<3")
ball=(--surface "sqrt(x*x+y*y+z*z)=1.01:bone")
around="box:-4,-2.5,-2.5,-3.9,2.5,2.5:120"
draw() { # NAME WORD ...
    local name=$1
    shift
    "$program" render sphere-flow.tlod -o "$name.png" --size 640x480 --samples 2 --quiet "${near[@]}" "$@"
}
draw volume --volume pressure --range -1,1 --colormap cool-to-warm --title "a volume"
draw surfaces --surface pressure=-0.6:0.8 --surface pressure=-0.2:0.35 --surface pressure=0.2:0.5 --range -0.8,0.8 \
    --colormap cool-to-warm "${ball[@]}" --title "surfaces"
draw hybrid --volume pressure --range -1,1 --colormap cool-to-warm "${ball[@]}" --surface pressure=-0.3:gold:0.5 \
    --title "both, exact in depth"
draw points --points pressure=150000 --range -0.6,0.6 --title "points on all isosurfaces"
draw lines --lines velocity:width=2,halo,arrows=6 --seeds "$around" --box=-4,-0.6,-3,4,0.6,3 "${ball[@]}" \
    --colormap plasma --title "streamlines, ghosts beside a plane"
draw plane --slice y=50% --color-by "mag(velocity)" --range 0,1.5 "${ball[@]}" --title "a plane"
draw patches --color-patches --clip "y<0" --view 140,30 --error 0.3% --title "patches at 0.3 %"
draw levels --color-levels --clip "y<0" --view 140,30 --error 0.3% --title "levels at 0.3 %"
near=()
draw outlines --lines velocity:width=2,halo,dash=0.6 --seeds line:-4,-2,0,-4,2,0:25 --silhouettes --color-by pressure \
    --range -0.8,0.8 --colormap cool-to-warm --view 20,35,3.5 --annotation bar,error --title "silhouettes, dashes along the flow"
"$sheet" pictures.png 3 {volume,surfaces,hybrid,points,lines,plane,outlines,patches,levels}.png
rm -f {volume,surfaces,hybrid,points,lines,plane,outlines,patches,levels}.png
