#!/usr/bin/env bash
# demo_view.sh PROGRAM FOLDER: opens the viewer on FOLDER/sphere-flow.tlod where there is a display; where
# there is none it takes pictures of the window's features, tour-*.png, if Xvfb is there to draw on.
set -euo pipefail
program=$(realpath "$1")
cd "$2"

if [[ ! -x ${program%/*}/tetralod-view ]]; then
    printf '\nThe viewer was not built: GTK 4 is not there (Debian package libgtk-4-dev).\n'
    exit 0
fi

# What is shown: the pressure around the sphere.
cat > demo-view.txt <<'TEXT'
add transfer channel=pressure map=cool-to-warm range_by=values range=-1,1
view 30,15,4
TEXT

if [[ -n ${DISPLAY:-}${WAYLAND_DISPLAY:-} ]]; then
    printf '\n$ tetralod view sphere-flow.tlod\nThe window is open: drag turns, the wheel goes nearer, F1 shows all keys.\n'
    exec "$program" view sphere-flow.tlod --script demo-view.txt
fi
if ! command -v Xvfb > /dev/null; then
    printf '\nThere is no display to open the viewer on, and no Xvfb to take pictures of it (package xvfb).\n'
    exit 0
fi

printf '\nThere is no display to open the viewer on: taking pictures of it instead ...\n'
cat demo-view.txt - > demo-tour.txt <<'TEXT'
wait settled
screenshot tour-1-volume.png
add surface channel=pressure value=-0.3 color=gold opacity=0.6
add slice plane=y color_by=pressure
wait settled
screenshot tour-2-surface-and-slice.png
set volume1.visible off
set slice1.visible off
add lines channel=velocity seeds=line:-4,-2,0,-4,2,0:25 has_box=on box=-4,-0.6,-3,4,0.6,3
wait settled
screenshot tour-3-lines.png
set lines1.visible off
add boundary mark=patches opacity=1
add clip plane=0,0,0,0,1,0
wait settled
set detail.frozen on
view 80,25,2
wait settled
screenshot tour-4-frozen-cut.png
quit
TEXT
exec 3< <(Xvfb -displayfd 1 -screen 0 1280x860x24 -nolisten tcp -noreset 2> /dev/null & echo "pid $!"; wait)
display='' server=''
while [[ -z $display || -z $server ]] && read -r -t 20 word number <&3; do
    [[ $word == pid ]] && server=$number || display=$word
done
trap 'kill "$server" 2> /dev/null || true' EXIT
DISPLAY=:$display GTK_A11Y=none GSETTINGS_BACKEND=memory DBUS_SESSION_BUS_ADDRESS=disabled: \
    "$program" view sphere-flow.tlod --size 1200x800 --script demo-tour.txt
rm -f demo-tour.txt demo-view.txt
printf 'tour-*.png show its window.\n'
