#!/usr/bin/env bash
# Builds Color3D, starts its server, colours one scene end to end and says where the report is.
#   deploy/demo.sh [--benchmark | --no-benchmark] [PHOTOS] [OUT] [-- options of "color3d colorize"]
# PHOTOS: a folder of photos, alone or with a COLMAP model (sparse/0) or transforms.json; a film
# (.mp4, ...); or a folder of its frames, with "-- --film". Pictures in colour are run as a
# benchmark: their colour is dropped, one key view keeps its own, and the result is scored against
# the truth. For monochrome ones, and for a film, the demo selects the key view and says how to go
# on. Photos that may be either (stained prints, for example): it asks, when it has a terminal;
# --benchmark or --no-benchmark decides.
# Without PHOTOS a small procedural room is rendered first. OUT: default color3d-demo.
set -euo pipefail
here=$(pwd)
root=$(cd "$(dirname "$0")/.." && pwd)

positional=()
benchmark= # --benchmark, --no-benchmark, or empty: as the photos are
while [ "$#" -gt 0 ] && [ "$1" != "--" ]; do
  case "$1" in
    -h | --help) sed -n '2,11p' "$0" | cut -c3-; exit 0 ;;
    --benchmark | --no-benchmark) benchmark=$1 ;;
    -*) echo "demo: unknown option $1; see deploy/demo.sh --help (put options of color3d colorize after --)" >&2; exit 2 ;;
    *) positional+=("$1") ;;
  esac
  shift
done
[ "$#" -eq 0 ] || shift # the "--"
options=("$@")
photos=${positional[0]:-}
out=${positional[1]:-$here/color3d-demo}
if [ -n "$photos" ] && [ ! -e "$photos" ]; then
  echo "demo: $photos does not exist; give a folder of photos or a film" >&2
  exit 2
fi

"$root/deploy/install-deps.sh"
# Only the programs of the demo; tests/run.sh builds the rest into the same folder.
cmake -S "$root" -B "$root/build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOLOR3D_TESTS=OFF >/dev/null
cmake --build "$root/build" --target color3d color3d-server color3d-worker color3d-make-scene
bin="$root/build/bin"

mkdir -p "$out"
out=$(cd "$out" && pwd)
if [ -z "$photos" ]; then
  photos="$out/room"
  echo "demo: rendering a procedural room into $photos"
  "$bin/color3d-make-scene" "$photos" --views 16 --width 480 --height 360
fi

store="$out/server"
mkdir -p "$store"
rm -f "$store/address"
"$bin/color3d-server" serve --listen 127.0.0.1:0 --data-dir "$store" --port-file "$store/address" \
  >"$store/server.log" 2>&1 &
server=$!
stop_server() {
  kill "$server" 2>/dev/null || true
  wait "$server" 2>/dev/null || true
}
trap stop_server EXIT
trap 'exit 130' INT TERM
for _ in $(seq 150); do
  [ ! -s "$store/address" ] || break
  if ! kill -0 "$server" 2>/dev/null; then
    echo "demo: the server did not start:" >&2
    tail -n 5 "$store/server.log" >&2
    exit 1
  fi
  sleep 0.2
done
COLOR3D_SERVER=$(cat "$store/address")
export COLOR3D_SERVER
echo "demo: the server listens on $COLOR3D_SERVER; its data folder is $store"

if [ -z "$benchmark" ] && [ -d "$photos" ]; then
  seen=$("$bin/color3d" inspect "$photos") || seen=
  case "$seen" in colour*) benchmark=--benchmark ;; *) benchmark=--no-benchmark ;; esac
  if [[ "$seen" == *unsure* ]]; then
    echo "demo: $seen"
    if [ -t 0 ] && [ -t 2 ]; then
      read -r -p "demo: are the photos in colour, so that the result can be scored against them? [y/n] " answer || answer=
      case "$answer" in
        [yY]*) benchmark=--benchmark ;;
        [nN]*) benchmark=--no-benchmark ;;
      esac
    fi
    echo "demo: continuing with $benchmark; give --benchmark or --no-benchmark to choose"
  fi
fi
mode=()
if [ "$benchmark" = --benchmark ]; then
  mode=(--benchmark)
  echo "demo: the photos are in colour: removing their colour and scoring the result against it"
fi
"$bin/color3d" colorize "$photos" -o "$out" "${mode[@]}" "${options[@]}"

if [ -f "$out/report.html" ]; then
  echo "demo: the report is $out/report.html"
  if [ -f "$out/view.html" ]; then
    echo "demo: to view the scene in a browser: $bin/color3d view $out"
    echo "demo: to correct a colour: $bin/color3d-server serve --data-dir $store & sleep 2; $bin/color3d correct $out"
  elif [ -f "$out/scene.mp4" ]; then
    echo "demo: the coloured film is $out/scene.mp4"
  fi
else
  echo "demo: colour $out/key_view.png by any means, then run:"
  echo "  deploy/demo.sh $photos $out -- --key-color COLOURED.png"
  echo "or colour it automatically: deploy/demo.sh $photos $out -- --auto"
fi
