#!/usr/bin/env bash
# A simulated tunnel from its scan to leaks in QGIS, in ./demo, with a server and a database of its own.
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
    if "$tunneldb" survey list | grep -q '^demo-2024 '; then "$tunneldb" survey remove demo-2024 --yes; fi
    if "$tunneldb" tunnel list | grep -q '^demo '; then "$tunneldb" tunnel remove demo; fi
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
step intensity demo-2024 -o demo/intensity.png
step leaks demo-2024 --geometry map --format gpkg -o demo/leaks.gpkg
step image demo-2024 -o demo/images
step qgis demo-2024 -o demo/demo.qgz
step report demo-2024 -o demo/report.html

cat <<TEXT

Done in $((SECONDS - start)) s. Look at
  demo/images/         the unrolled lining
  demo/intensity.png   whether intensity depends on range or incidence, before and after correction
  demo/leaks.gpkg      the leaks on the map
  demo/demo.qgz        the project for QGIS
  demo/report.html     the inspection report
The demo's server runs on, for QGIS; to stop it: TUNNELDB_HOME=$TUNNELDB_HOME $tunneldb server stop
TEXT
