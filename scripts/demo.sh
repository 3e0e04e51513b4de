#!/usr/bin/env bash
# A simulated tunnel from its scan to leaks in QGIS, in ./demo, with a server and a database of its own; then 40 m of a tunnel
# seen from two tripods, at ranges of 3 to 16 m, to show what the correction of intensity does.
# Usage: scripts/demo.sh [path of tunneldb]
set -euo pipefail
cd "$(dirname "$0")/.."

tunneldb=${1:-tunneldb}
mkdir -p demo
export TUNNELDB_HOME=$PWD/demo/home
unset TUNNELDB_DSN

step() {
    printf '\n\033[1m$ tunneldb %s\033[0m\n' "$*"
    "$tunneldb" "$@"
}

remove_former() { # of an earlier demo
    local name
    for name in demo tripod; do
        if "$tunneldb" survey list | grep -q "^$name-2024 "; then "$tunneldb" survey remove "$name-2024" --yes; fi
        if "$tunneldb" tunnel list | grep -q "^$name "; then "$tunneldb" tunnel remove "$name"; fi
    done
}

start=$SECONDS
step simulate demo/scan --preset demo --name demo --lining segments --soot 2 --paint 4 --patches 4 --joint-leaks 2 --drips
step init
remove_former
step tunnel add demo --srid 25830 --axis demo/scan/demo.axis.csv --start-chainage 12300
step survey add demo-2024 --tunnel demo --date 2024-05-04 --trajectory demo/scan/demo.trajectory.csv \
    --reference demo/scan/demo.reference.csv --intensity Amplitude --intensity-kind amplitude
step load demo-2024 demo/scan/demo*.laz
step run demo-2024
step status
step leaks demo-2024
step leaks demo-2024 --by-km
step evaluate demo-2024 demo/scan/demo.truth.gpkg
step leaks demo-2024 --geometry map --format gpkg -o demo/leaks.gpkg
step image demo-2024 -o demo/images
step qgis demo-2024 -o demo/demo.qgz
step report demo-2024 -o demo/report.html

step simulate demo/tripod --name tripod --length 40 --radius 0 --station-spacing 25 --angular-step 0.3 --leaks 2
step tunnel add tripod --srid 25830 --axis demo/tripod/tripod.axis.csv
step survey add tripod-2024 --tunnel tripod --date 2024-05-04 --stations demo/tripod/tripod.stations.csv \
    --reference demo/tripod/tripod.reference.csv --intensity Amplitude --intensity-kind amplitude
step load tripod-2024 demo/tripod/tripod.laz
step run tripod-2024 --to ground
step intensity tripod-2024 -o demo/intensity.png

cat <<TEXT

Done in $((SECONDS - start)) s. Look at
  demo/images/         unrolled lining
  demo/leaks.gpkg      leaks on the map
  demo/demo.qgz        project for QGIS
  demo/report.html     inspection report
  demo/intensity.png   intensity against range and incidence, before and after correction
or in a browser: TUNNELDB_HOME=$TUNNELDB_HOME $tunneldb serve
The server of the demo keeps running for QGIS. To stop it: TUNNELDB_HOME=$TUNNELDB_HOME $tunneldb server stop
TEXT
