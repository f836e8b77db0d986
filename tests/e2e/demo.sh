#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The story of dsgdb in a few seconds: a generated office, its log, a store, a server, questions.
# Takes the programs from DSG_BIN; leaves nothing behind unless a folder to keep is given.
set -euo pipefail

readonly SEED=12 PEOPLE=12 SECONDS_SIMULATED=300 PICKS=2
: "${DSG_BIN:?names the folder of the programs; ./dev demo sets it}"
# What the caller's shell names is another store.
unset DSG_STORE DSG_SERVER DSG_MAP
PATH=$(cd "$DSG_BIN" && pwd):$PATH
server_pid=

say() { printf '\n== %s\n' "$*"; }

# Shows a command as a person would type it, then runs it.
show() {
  printf '$ %s\n' "$*"
  "$@"
}

clean_up() {
  if [[ -n $server_pid ]] && kill -0 "$server_pid" 2>/dev/null; then
    kill -KILL "$server_pid"
  fi
  [[ -n $kept ]] || rm -rf "$folder"
}

# Ready means that it answers, not that some time has passed.
wait_for_server() {
  local deadline=$((SECONDS + 20))
  until dsg stats --timeout 1 >/dev/null 2>server.ready; do
    if ! kill -0 "$server_pid" 2>/dev/null || ((SECONDS > deadline)); then
      cat server.log server.ready >&2
      printf 'demo: dsg-server did not become ready\n' >&2
      return 1
    fi
    sleep 0.05
  done
}

stop_server() {
  local status=0
  printf '$ kill -TERM %s\n' "$server_pid"
  kill -TERM "$server_pid"
  wait "$server_pid" || status=$?
  server_pid=
  if ((status)); then
    cat server.log >&2
    printf 'demo: dsg-server exited %d, expected 0\n' "$status" >&2
    return 1
  fi
  printf 'dsg-server exited 0\n'
}

http=()
if [[ ${1:-} == --serve ]]; then
  http=(--http 127.0.0.1:0)
  shift
fi
kept=${1:-}
folder=${kept:-$(mktemp -d "${TMPDIR:-/tmp}/dsg-demo.XXXXXX")}
mkdir -p "$folder"
if [[ -n $(ls -A "$folder") ]]; then
  printf 'demo: the folder %s holds something already; name a new one\n' "$folder" >&2
  kept=$folder
  exit 2
fi
trap clean_up EXIT
cd "$folder"

say "1. An office: $PEOPLE people and a robot walk for $SECONDS_SIMULATED s, a tracker watches"
show dsg-simulate tracks --out office --seed "$SEED" --people "$PEOPLE" \
  --seconds "$SECONDS_SIMULATED" --picks "$PICKS"

say '2. The log becomes a versioned scene graph in a store'
show dsg-ingest --store store --map office office/log

say '3. A server answers for the store over gRPC'
printf '$ %s &\n' "dsg-server --store store --listen unix:dsg.sock${http[*]:+ ${http[*]}}"
dsg-server --store store --listen unix:dsg.sock "${http[@]}" >server.log 2>&1 &
server_pid=$!
printf '$ export DSG_SERVER=unix:dsg.sock DSG_MAP=office\n'
export DSG_SERVER=unix:dsg.sock DSG_MAP=office
wait_for_server
printf 'ready\n'

say '4. Where was carol at three instants?'
show dsg where carol --at +30s
show dsg where carol --at +100.25s
show dsg where carol --at +3m

say '5. Who was in the kitchen during the second minute?'
show dsg who --room kitchen --from +1m --to +2m

say '6. What does the map hold?'
show dsg stats

if ((${#http[@]})); then
  say '7. The map in a browser, until Ctrl-C'
  grep -o 'http://.*' server.log
  # Ctrl-C reaches the server too, which stops in order.
  trap ':' INT
  until ! kill -0 "$server_pid" 2>/dev/null; do wait "$server_pid" || true; done
  server_pid=
else
  say '7. The server stops in order'
  stop_server
fi
[[ -z $kept ]] || printf 'kept in %s\n' "$folder"
((${#http[@]})) || printf 'its map in a browser: ./dev demo --serve\n'
