#!/usr/bin/env bash
# A simulated steel structure from its scan to spots in QGIS, in ./demo, with a server and a database of its own.
# Usage: scripts/demo-structure.sh [path of tunneldb]
set -euo pipefail
cd "$(dirname "$0")/.."

tunneldb=${1:-tunneldb}
mkdir -p demo/hall
export TUNNELDB_HOME=$PWD/demo/home
unset TUNNELDB_DSN

step() {
    printf '\n\033[1m$ tunneldb %s\033[0m\n' "$*"
    "$tunneldb" "$@"
}

remove_former() { # of an earlier demo
    if "$tunneldb" survey list | grep -q '^hall-2024 '; then "$tunneldb" survey remove hall-2024 --yes; fi
    if "$tunneldb" tunnel list | grep -q '^hall '; then "$tunneldb" tunnel remove hall; fi
}

start=$SECONDS
step simulate-structure demo/hall --name hall --width 4 --angular-step 0.12 --anomalies 12 --seed 5
step init
remove_former
step tunnel add hall --srid 25830 --site
step survey add hall-2024 --tunnel hall --date 2024-05-04 --stations demo/hall/hall.stations.csv \
    --reference demo/hall/hall.reference.csv --intensity Amplitude --intensity-kind amplitude
step load hall-2024 demo/hall/hall.laz
step members hall-2024
step spots hall-2024 --geometry 3d -o demo/hall/spots.gpkg
step evaluate hall-2024 demo/hall/hall.truth.json
step qgis hall-2024 -o demo/hall.qgz
step report hall-2024 -o demo/hall.html

cat <<TEXT

Done in $((SECONDS - start)) s. Look at
  demo/hall/spots.gpkg   what is dark or bright against its own surface, in space
  demo/hall.qgz          the project for QGIS: faces in space, an atlas of members, spots to be reviewed
  demo/hall.html         the report
The demo's server runs on, for QGIS; to stop it: TUNNELDB_HOME=$TUNNELDB_HOME $tunneldb server stop
TEXT
