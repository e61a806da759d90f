#!/usr/bin/env bash
# Which folder may include which (DESIGN: base <- {color, image, weights} <- {scene, encoder} <-
# {keyview, keycolor, augment, colorizer, splat, metrics} <- stage; torch only where networks live).
set -euo pipefail
cd "$(dirname "$0")/.."
failed=0

# allow FOLDER REGEX: every include of our own by FOLDER's sources matches REGEX, but for the error
# type that the whole server shares.
allow() {
  local bad
  bad=$(grep -rnE '#include "(core|server|client|tests)/' "$1" --include='*.h' --include='*.cc' |
    grep -vE "#include \"(($2)/|server/service_error\.h)" || true)
  if [ -n "$bad" ]; then
    echo "check_layers: $1 may not include:" >&2
    echo "$bad" >&2
    failed=1
  fi
}
# forbid REGEX FOLDER...: no source there has an include that matches REGEX.
forbid() {
  local pattern=$1 bad
  shift
  bad=$(grep -rnE "#include [<\"]($pattern)" "$@" --include='*.h' --include='*.cc' || true)
  if [ -n "$bad" ]; then
    echo "check_layers: not allowed here:" >&2
    echo "$bad" >&2
    failed=1
  fi
}

allow core/base 'core/base'
allow core/color 'core/(base|color)'
allow core/image 'core/(base|image)'
allow core/weights 'core/(base|weights)'
allow core/scene 'core/(base|color|image|scene)'
allow core/encoder 'core/(base|color|image|weights|encoder)'
for folder in keyview keycolor augment metrics; do
  allow "core/$folder" "core/(base|color|image|weights|scene|encoder|$folder)"
done
allow core/carry 'core/(base|color|image|scene|keycolor|carry)'
allow core/colorizer 'core/(base|color|image|weights|encoder|augment|colorizer)'
allow core/splat 'core/(base|color|image|scene|splat)'
allow core/report 'core/(base|image|report)'
allow core/stage 'core/[a-z]+|tests/support'  # its tests render a scene
allow server/jobs 'core/base|server/jobs'
allow server/storage 'core/base|server/(jobs|storage)'
allow server/backends 'core/(base|keycolor)|server/(ops|backends)'
allow server/rpc 'core/base|core/image|server/(jobs|storage|ops|rpc)'
allow client 'core/(base|color|image)|client(/[a-z]+)?'

forbid 'torch/|ATen/|c10/' core/base core/color core/image core/weights core/scene core/keyview \
  core/splat core/metrics core/report core/stage server client
# The networks of keycolor have torch; hints, pictures and prompts do not.
forbid 'torch/|ATen/|c10/' $(ls core/keycolor/*.h core/keycolor/*.cc |
  grep -vE '/(color_head|color_queries|ddcolor|embedded_colorizer|folded_norms|script)')
forbid 'grpc|google/protobuf|color3d/v1|sqlite3|spdlog' core
forbid 'sqlite3' server/rpc server/worker client
forbid 'opencv2' server client core/splat core/base

if [ "$failed" -ne 0 ]; then exit 1; fi
echo "check_layers: ok"
