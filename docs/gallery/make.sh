#!/usr/bin/env bash
# make.sh PROGRAM DATA: makes the pictures of the gallery anew, here; DATA is the folder of real data.
set -euo pipefail
program=$(realpath "$1") data=$(realpath "$2")
cd "$(dirname "$0")"

draw() { "$program" render "$@" --quiet --size 800x600 --samples 3; }

draw "$data/curvilinear/bluntfin.vtk" -o blunt-fin.png --volume Density --lines Momentum:width=1.6,arrows=6,halo \
    --color-by "mag(Momentum)" --seeds box:-6,0.2,0.1,-5,4,3:60 --view 35,35,1.05
draw "$data/volume/neghip_64x64x64_uint8.raw" --raw 64,64,64,u8 -o neghip.png --volume value --colormap inferno \
    --background black --view 40,25
draw "$data/curvilinear/combxyz.bin" --solution "$data/curvilinear/combq.bin" -o combustor.png --boundary --silhouettes \
    --lines Momentum:width=1.8,halo --color-by "mag(Momentum)" --seeds grid:12 --colormap plasma
draw "$data/cgns/HeatingCoil.cgns" -o heating-coil.png --hide-regions FluidZone --boundary --color-by Temperature \
    --colormap inferno --view 20,25
draw "$data/cgns/HeatingCoil.cgns" -o heating-coil-flow.png --lines Velocity:width=1.6,halo,arrows=7 --boundary --silhouettes \
    --color-by "mag(Velocity)" --colormap plasma --seeds plane:0,0,0.1,0,0,1:90 --view 30,15
draw "$data/tet/bracket_appended_compressed.vtu" -o bracket.png --boundary --edges --color-by sj2p --range 2%,98% \
    --colormap cividis
draw "$data/hexmixed/fire_ug.vtu" -o fire.png --volume t --lines uvw:width=1.6,halo,arrows=6 --color-by "mag(uvw)" \
    --colormap plasma --seeds grid:8 --view 40,25
draw "$data/volume/hydrogen.vti" -o hydrogen.png --surface probability_density=5%:0.35 --surface probability_density=25%:0.6 \
    --surface probability_density=60% --view 35,20
