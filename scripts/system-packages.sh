#!/usr/bin/env bash
# Installs by apt what the embedded server, the tests and QGIS, and the benchmarks' peers need, unless it is there.
# Usage: scripts/system-packages.sh [server] [tests] [bench]
set -euo pipefail

wanted=("$@")
packages=()

# The newest PostgreSQL that both is packaged and has PostGIS; 15 on Debian 12.
postgresql_version() {
    apt-cache search --names-only '^postgresql-[0-9]+-postgis-3$' | sed -E 's/^postgresql-([0-9]+)-.*/\1/' | sort -n | tail -n 1
}

need() { # a package, unless a file that it brings is there
    local package=$1
    shift
    compgen -G "$1" > /dev/null || packages+=("$package")
}

on_offer() { # whether apt has a package (Ubuntu has Chromium as a snap alone); as long as its lists are empty it may
    [ -z "$(apt-cache madison bash 2> /dev/null)" ] || [ -n "$(apt-cache madison "$1" 2> /dev/null)" ]
}

collect() {
    local version
    version=$(postgresql_version)
    for what in "${wanted[@]}"; do
        case $what in
            server)
                need "postgresql-${version}-postgis-3" '/usr/share/postgresql/*/extension/postgis.control'
                need "postgresql-${version}" '/usr/lib/postgresql/*/bin/postgres'
                python3 -c 'import ensurepip' 2> /dev/null || packages+=(python3-venv)
                ;;
            tests)
                need "postgresql-${version}-plpgsql-check" '/usr/share/postgresql/*/extension/plpgsql_check.control'
                need qgis '/usr/bin/qgis_process'
                need python3-qgis '/usr/lib/python3/dist-packages/qgis/core/__init__.py'
                need qgis-providers '/usr/lib/qgis/plugins/libprovider_postgres.so'
                need iproute2 '/usr/*bin/ip'
                need xvfb '/usr/bin/xvfb-run'
                if on_offer chromium; then need chromium '/usr/bin/chromium'; fi
                ;;
            bench)
                need "postgresql-${version}-pointcloud" '/usr/share/postgresql/*/extension/pointcloud.control'
                ;;
        esac
    done
}

have_everything() {
    packages=()
    collect
    [ ${#packages[@]} -eq 0 ]
}

if ! command -v apt-get > /dev/null; then
    echo "no apt here: PostgreSQL 14 or newer with PostGIS 3.3 or newer must be installed some other way" >&2
    exit 0
fi
have_everything && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo > /dev/null || { echo "missing: ${packages[*]}; install them as root" >&2; exit 1; }
    as_root=(sudo)
fi
"${as_root[@]}" apt-get update -q
have_everything || true # the versions are known now
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -q -y --no-install-recommends "${packages[@]}"
