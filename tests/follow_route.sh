#!/bin/sh
# Runs the demonstration of docs/client.md on a small city: follow_route.sh BTMS FOLLOW_ROUTE
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$(dirname "$0")/../apps/examples/follow_route.sh" "$1" "$2" "$folder/drive.png" 4 | tee "$folder/said"
grep -q 'route of .* on revision 2' "$folder/said"
grep -q '^arrived' "$folder/said"
[ "$(head -c 4 "$folder/drive.png" | tail -c 3)" = PNG ]
