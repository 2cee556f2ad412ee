#!/bin/bash
# btms-mpi on three hosts, each with its own name and address: network namespaces joined by a switch, a launch agent
# instead of ssh. Then one of them is cut off in the middle of a build: the job ends, there is no half map, and --resume
# on the other two ends with the same digest. Needs root; tests/mpi.sh builds what it runs.
#   tests/mpi_hosts.sh
set -euo pipefail
cd "$(dirname "$0")/.."
case ${1:-} in -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;; esac
bin=$PWD/build/mpi/bin
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
if ! command -v ip >/dev/null || ! command -v unshare >/dev/null || ! ip netns add btms-switch 2>/dev/null; then
  echo "mpi_hosts.sh: no right to make network namespaces here: not tested"
  exit 0
fi
folder=$(mktemp -d)
cleanup() {
  for name in btms-host1 btms-host2 btms-host3 btms-switch; do ip netns del "$name" 2>/dev/null || true; done
  rm -rf "$folder"
}
trap cleanup EXIT

ip -n btms-switch link add lan type bridge
ip -n btms-switch link set lan up
for i in 1 2 3; do
  ip netns add "btms-host$i"
  ip -n btms-switch link add "port$i" type veth peer name lan netns "btms-host$i"
  ip -n btms-switch link set "port$i" master lan up
  ip -n "btms-host$i" addr add "10.77.0.$i/24" dev lan
  ip -n "btms-host$i" link set lan up
  ip -n "btms-host$i" link set lo up
done
# What ssh would do: HOST COMMAND...
cat >"$folder/agent" <<'AGENT'
#!/bin/bash
host=btms-host${1##*.}
shift
exec ip netns exec "$host" unshare --uts bash -c "hostname $host; $*"
AGENT
chmod +x "$folder/agent"

# mpi HOSTS ARGUMENT...: one rank a host, started on the first. A host that doesn't answer for some seconds is lost.
mpi() {
  local hosts=$1
  shift
  local at
  at=$(seq -s, -f '10.77.0.%g:1' "$hosts")
  "$folder/agent" 10.77.0.1 mpirun --mca plm_rsh_agent "$folder/agent" --mca btl tcp,self --mca btl_tcp_if_include 10.77.0.0/24 \
    --mca oob_tcp_if_include 10.77.0.0/24 --mca oob_tcp_keepalive_time 2 --mca oob_tcp_keepalive_intvl 1 --mca oob_tcp_keepalive_probes 3 \
    --host "$at" --bind-to none "$bin/btms-mpi" "$@"
}
digest() { "$bin/btms" digest "$1" | grep -oE '[0-9a-f]{32}' | head -1; }
now_ms() { echo $(($(date +%s%N) / 1000000)); }

"$bin/btms" synth --points "${BTMS_HOSTS_POINTS:-4000000}" -o "$folder/city" --quiet
"$bin/btms" build "$folder/city" -o "$folder/one.btms" --quiet >/dev/null
wanted=$(digest "$folder/one.btms")

began=$(now_ms)
mpi 3 build "$folder/city" -o "$folder/map.btms" --threads 1 --tile-cells 2 --quiet >/dev/null
whole_ms=$(($(now_ms) - began))
[ "$(digest "$folder/map.btms")" = "$wanted" ] || { echo "another digest by three hosts"; exit 1; }
rm -rf "$folder/map.btms"

# As late as possible, so that something is committed: 9 tenths of the time.
hit=0
for share in 0.5 0.7 0.9; do
  mpi 3 build "$folder/city" -o "$folder/map.btms" --threads 1 --tile-cells 2 --checkpoint-every 0.1 --quiet >/dev/null 2>"$folder/said" &
  run=$!
  sleep "$(awk -v ms="$whole_ms" -v share="$share" 'BEGIN { print ms / 1000 * share }')"
  ip -n btms-switch link set port3 down
  cut=$(now_ms)
  status=0
  wait "$run" || status=$?
  noticed_ms=$(($(now_ms) - cut))
  for _ in $(seq 300); do pgrep -f "$bin/btms-mpi build" >/dev/null || break; sleep 0.1; done
  if pgrep -f "$bin/btms-mpi build" >/dev/null; then echo "ranks are left behind"; exit 1; fi
  ip -n btms-switch link set port3 up
  if [ "$status" != 0 ]; then
    hit=$((hit + 1))
    echo "host 3 cut off: noticed after $noticed_ms ms, exit status $status: $(grep -iE 'lost|abort|fail' "$folder/said" | head -1)"
    resume=--resume
    [ -d "$folder/map.btms" ] || resume=
    # shellcheck disable=SC2086  # no word when there is nothing to take up
    "$bin/btms" info "$folder/map.btms" >/dev/null 2>&1 ||
      mpi 2 build "$folder/city" -o "$folder/map.btms" --threads 1 --tile-cells 2 --quiet $resume >/dev/null
  fi
  [ "$(digest "$folder/map.btms")" = "$wanted" ] || { echo "another digest, or half a map, after host 3 was cut off"; exit 1; }
  rm -rf "$folder/map.btms"
done
[ "$hit" -gt 0 ] || { echo "no running job was hit"; exit 1; }
echo "three hosts: one digest; $hit of 3 cuts hit a running job, no half map, the same digest after --resume on two hosts"
