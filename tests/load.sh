#!/bin/sh
# The tile server's throughput, by wrk (cmake/install-deps.sh --load), and what it bears (trial_server).
#   tests/load.sh [SECONDS a run, 10]
# Server and load share this machine. Needs the release build.
set -eu
cd "$(dirname "$0")/.."
case ${1:-} in -h | --help) sed -n '2,4s/^# //p' "$0"; exit 0 ;; esac
seconds=${1:-10}
bin=build/release/bin
folder=$(mktemp -d)
trap 'kill "$server" 2>/dev/null || true; rm -rf "$folder"' EXIT
server=
"$bin/btms" synth --points 2000000 -o "$folder/truth" --quiet
"$bin/btms" build "$folder/truth" -o "$folder/city.btms" --quiet
"$bin/btms" serve "$folder/city.btms" --port 0 > "$folder/url" &
server=$!
until [ -s "$folder/url" ]; do sleep 0.1; done
url=$(cat "$folder/url")v1/maps/city/tiles/0/0/0
"$bin/trial_server"
echo "one tile of 64 KiB, $(curl -fsS "$url" | wc -c) bytes:"
for connections in 8 64 512; do
  wrk -t 1 -c "$connections" -d "${seconds}s" --latency "$url" > "$folder/wrk"
  awk -v n="$connections" '/99%/ { p99 = $2 } /50%/ { p50 = $2 } /Requests.sec/ { rate = $2 } /Socket errors|Non-2xx/ { print }
    END { printf "%d connections: %.0f requests/s, median %s, p99 %s\n", n, rate, p50, p99 }' "$folder/wrk"
done
