#!/usr/bin/env bash
# Takes 30 m of a simulated tunnel through all stages and looks for the members of a small structure, so that Numba compiles their loops once: all later processes find them
# compiled, where else each of those that start together would compile them for itself.
# Usage: scripts/compile.sh [path of tunneldb]
set -euo pipefail

tunneldb=${1:-tunneldb}
folder=$(mktemp -d)
chmod a+rx "$folder"
export TUNNELDB_HOME=$folder/home
unset TUNNELDB_DSN
remove() {
    "$tunneldb" server stop > /dev/null 2>&1 || true
    rm -rf "$folder"
}
trap remove EXIT

step() { "$tunneldb" "$@" > /dev/null; }

step simulate "$folder/scan" --preset demo --name scan --length 30 --straight 0 --density 400
step init
step tunnel add scan --srid 25830 --axis "$folder/scan/scan.axis.csv"
step survey add scan --tunnel scan --date 2024-05-04 --trajectory "$folder/scan/scan.trajectory.csv" \
    --reference "$folder/scan/scan.reference.csv" --intensity Amplitude --intensity-kind amplitude
step load scan "$folder"/scan/scan*.laz
step run scan
step simulate-structure "$folder/plant" --name plant --width 3 --angular-step 0.25 --anomalies 4
step members "$folder/plant/plant.laz" --stations "$folder/plant/plant.stations.csv" --intensity Amplitude \
    --intensity-kind amplitude -o "$folder/plant.laz"
