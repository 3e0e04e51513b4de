#!/usr/bin/env bash
# A simulated canal tunnel from its laser and sonar scans to closed sections, bed and report, in ./demo, with a server of its own.
# Usage: scripts/demo-canal.sh [path of tunneldb]
set -euo pipefail
cd "$(dirname "$0")/.."

tunneldb=${1:-tunneldb}
mkdir -p demo/canal
export TUNNELDB_HOME=$PWD/demo/home
unset TUNNELDB_DSN

step() {
    printf '\n\033[1m$ tunneldb %s\033[0m\n' "$*"
    "$tunneldb" "$@"
}

remove_former() { # of an earlier demo
    if "$tunneldb" survey list | grep -q '^canal-2026 '; then "$tunneldb" survey remove canal-2026 --yes; fi
    if "$tunneldb" tunnel list | grep -q '^canal '; then "$tunneldb" tunnel remove canal; fi
}

start=$SECONDS
sonar=(demo/canal/canal.sonar-{1,2,3}.xyz)
step simulate-canal demo/canal --name canal --batter 2 --towpath right --objects 4 --niches 2 --seed 5
step init
remove_former
step tunnel add canal --srid 25832 --axis demo/canal/canal.axis.csv
step survey add canal-2026 --tunnel canal --date 2026-05-04 --stations demo/canal/canal.stations.csv --intensity-kind none
step load canal-2026 demo/canal/canal.laz
step register canal-2026 "${sonar[@]}" --ladders demo/canal/canal.ladders.csv --up +z --water-level 265.0 \
    --report demo/canal/registration.md
step load canal-2026 "${sonar[@]}"
step run canal-2026
step psql -- -c "SELECT label, depth, wet_area, unseen FROM tunnel_api.closed_section ORDER BY chainage" \
    -c "SELECT * FROM tunnel_api.bed_volume('canal-2026', 10, 30, 262.5)"
step qgis canal-2026 -o demo/canal.qgz
step report canal-2026 -o demo/canal.html

cat <<TEXT

Done in $((SECONDS - start)) s. Look at
  demo/canal/registration.md  where the sonar stood, and how well that is known
  demo/canal.qgz              the project for QGIS: the bed on the map, sections below the water, the lining unrolled
  demo/canal.html             the report, with a chapter on what lies under the water
The demo's server runs on, for QGIS; to stop it: TUNNELDB_HOME=$TUNNELDB_HOME $tunneldb server stop
TEXT
