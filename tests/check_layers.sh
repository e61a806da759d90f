#!/usr/bin/env bash
# Which folder may include which, from bottom to top:
#   core:   base <- {trace, catalogue, simd, grid, color, image, zip <- weights} <- {scene, encoder}
#           <- {keyview, augment, carry <- film, splat, metrics, report, video, view, matching <- {keycolor, colorizer}}
#           <- stage: {context, options} <- formats <- sources <- movie <- film_import <- film <- coloring <- {recolor, report} <- stages
#   colorizer: colorizer <- model <- neighbors <- training <- personal
#   scene:  scene <- {masks, formats} <- sfm <- import
#   server: base <- store <- {planning, storage, net, tracing} <- rpc; backends and worker beside it; client apart from all.
# LibTorch is included only by folders with networks, protocol buffers only by the server and above. Below
# the server SQL is used only for COLMAP's database (core/scene/sfm/sfm_database.cc). Tests (*_test.cc) are
# exempt; the product never includes tests/.
set -euo pipefail
cd "$(dirname "$0")/.."
failed=0

complain() {
  echo "check_layers: $1" >&2
  echo "$2" >&2
  failed=1
}

# allow FOLDER REGEX: all project includes of FOLDER's sources match REGEX or are from core/base.
# Tests are exempt.
allow() {
  local bad
  bad=$(grep -rnE '#include "(core|server|client|tests)/' "$1" --include='*.h' --include='*.cc' |
    grep -vE "#include \"(core/base/(text|process)|$2)/" |
    grep -v '^[^:]*_test\.cc:' || true)
  [ -z "$bad" ] || complain "$1 may not include:" "$bad"
}
# allow_own FOLDER REGEX: the same, without subfolders.
allow_own() {
  local bad
  bad=$(grep -nE '#include "(core|server|client|tests)/' "$1"/*.h "$1"/*.cc |
    grep -vE "#include \"(core/base/(text|process)|$2)/" |
    grep -v '^[^:]*_test\.cc:' || true)
  [ -z "$bad" ] || complain "$1 may not include:" "$bad"
}
# forbid REGEX FOLDER...: no include of these folders matches REGEX.
forbid() {
  local pattern=$1 bad
  shift
  bad=$(grep -rnE "#include [<\"]($pattern)" "$@" --include='*.h' --include='*.cc' || true)
  [ -z "$bad" ] || complain "not allowed here:" "$bad"
}
allow core/base 'core/base'
allow core/trace 'core/(base|trace)'
allow core/catalogue 'core/(base|catalogue|image/probe)'
allow core/simd 'core/(base|simd)'
allow core/grid 'core/(base|simd|grid)'
allow core/color 'core/(base|color)'
allow core/image 'core/(base|image(/(probe|decode))?)'
allow core/image/credit 'core/(base|image(/credit)?)'
allow core/image/decode 'core/(base|image/(probe|decode))'
allow core/image/probe 'core/(base|image/probe)'
allow core/zip 'core/(base|zip)'
allow core/weights 'core/(base|zip|weights)'
allow core/scene 'core/(base|catalogue|simd|color|image(/probe)?|scene(/[a-z]+)?)'
scene='base|catalogue|simd|color|image(/probe)?'
allow_own core/scene "core/($scene|scene)"
allow core/scene/masks "core/($scene|scene(/masks)?)"
allow core/scene/formats "core/($scene|scene(/formats)?)"
allow core/scene/sfm "core/($scene|scene(/(formats|sfm))?)"
allow core/scene/import "core/($scene|scene(/(masks|formats|sfm|import))?)"
allow core/encoder 'core/(base|color|image|weights|encoder(/[a-z]+)?)'
for folder in keyview augment metrics; do
  allow "core/$folder" "core/(base|catalogue|color|image|weights|scene|encoder|$folder)"
done
allow core/matching 'core/(base|encoder(/[a-z]+)?|matching)'
allow core/keycolor \
  'core/(base|grid|color|image|weights|encoder(/[a-z]+)?|matching|keycolor(/[a-z]+)?)'
allow core/keycolor/hints 'core/(base|grid|color|image|keycolor/hints)'
for source in references words automatic external; do
  allow "core/keycolor/$source" \
    "core/(base|grid|color|image|weights|encoder(/[a-z]+)?|matching|keycolor(/hints)?|keycolor/$source)"
done
allow core/carry 'core/(base|simd|grid|color|image|scene|carry)'
colorizer='base|color|image|weights|encoder(/[a-z]+)?|matching|augment|colorizer'
allow_own core/colorizer "core/($colorizer)"
for part in model neighbors training personal; do
  colorizer="$colorizer|colorizer/$part"
  allow "core/colorizer/$part" "core/($colorizer)"
done
lower=
for part in model hexplane motion raster training movers geometry chroma export import; do
  lower="$lower${lower:+|}$part"
  allow "core/splat/$part" "core/(base|catalogue|zip|simd|color|image|scene|splat/($lower))"
done
allow core/report 'core/(base|catalogue|image|report)'
allow core/video 'core/(base|video)'
allow core/film 'core/(base|image|carry|film)'
allow core/view 'core/(base|zip|scene|view(/path)?)'
allow core/view/path 'core/(base|scene|view(/path)?)'
# Below the stages: their context and options, the formats of artifacts, then code that several stages
# share. Other folders of core do not depend on stages.
below='core/([a-rt-z][a-z]*|scene|simd|splat)(/[a-z]+)?'
parts=
for part in context options formats sources movie film_import film coloring recolor report; do
  parts="$parts${parts:+|}$part"
  case "$part" in
    context) allow core/stage/context "$below|core/stage/context" ;;
    options) allow core/stage/options "$below|core/stage/options" ;;
    *) allow "core/stage/$part" "$below|core/stage/($parts)" ;;
  esac
done
allow_own core/stage "$below|core/stage(/($parts))?"
allow proto 'proto'
allow server/base 'core/(base|catalogue)|server/base'
allow server/store 'core/(base|catalogue)|server/(base|store)'
allow server/keeping 'core/(base|catalogue)|server/(base|store|storage|keeping)'
allow server/planning 'core/(base|catalogue)|server/(base|store|planning)'
allow server/access 'core/base|server/access'
allow server/notify 'core/base|server/(access|store|ops|notify)'
allow server/metrics 'core/base|server/(net|store|storage|metrics)'
allow server/tracing 'core/(base|trace)|server/(store|tracing)'
allow server/storage 'core/base|server/(base|store|storage)'
allow server/backends 'core/(base|keycolor/external)|server/(ops|backends)'
allow server/net 'core/base|server/net'
allow server/rpc 'core/(base|catalogue|image/probe|trace)|server/(base|access|net|store|planning|storage|ops|rpc)'
# Workers' calls include the streams of blobs.
allow server/rpc/workers \
  'core/(base|catalogue)|server/(base|access|net|store|planning|storage|ops|rpc/(calls|blobs|workers))'
for folder in blobs jobs live scenes; do
  allow "server/rpc/$folder" \
    "core/(base|catalogue|image/probe|trace)|server/(base|access|net|store|planning|storage|ops|rpc/(calls|$folder))"
done
allow server/rpc/calls 'core/(base|catalogue|trace)|server/(base|access|net|store|planning|storage|ops|rpc/calls)'
allow server/worker/supervision 'core/base|server/(store|ops|worker/supervision)'
allow server/worker/live \
  'core/(base|color|colorizer|encoder|image|keycolor)|server/(base|ops|rpc/calls|storage|store|worker/(live|remote))'
allow server/worker/remote 'core/base|server/(base|ops|rpc/calls|storage|store|worker/remote)'
allow client 'core/(base|catalogue|color|image(/(credit|probe))?|scene|trace|video|zip)|client(/[a-z]+)?'
forbid 'core/scene/' client/commands client/lib client/options  # the studio shows undistorted photos

forbid 'torch/|ATen/|c10/' core/base core/zip core/simd core/grid core/color core/image core/weights \
  core/scene core/keyview core/splat core/metrics core/report core/view core/stage server client \
  core/keycolor/hints core/keycolor/words
forbid 'grpc|google/protobuf|color3d/v1|spdlog' core
forbid 'sqlite3' $(find core -name '*.h' -o -name '*.cc' | grep -v '^core/scene/sfm/sfm_database')
forbid 'libav|libsw' $(ls -d core/*/ | grep -v '^core/video/') server client
forbid 'sqlite3' server/rpc server/worker client
# Workers call the store of the server, and never open its file.
forbid 'server/store/sqlite' $(find server/worker -name '*.h' -o -name '*.cc' ! -name '*_test.cc')
forbid 'opencv2' server client core/splat core/base core/zip core/simd core/grid

# public FOLDER HEADER...: the headers of FOLDER that the product may include from outside. (Tests and
# benchmarks may include all.)
public() {
  local folder=$1 known bad
  shift
  known=$(printf '%s|' "$@")
  bad=$(grep -rnE "#include \"$folder/" core server client deploy --include='*.h' --include='*.cc' |
    grep -vE "^($folder/|[^:]*_test\.cc:)" |
    grep -vE "#include \"$folder/(${known%|})\.h\"" || true)
  [ -z "$bad" ] || complain "headers private to $folder:" "$bad"
}

public core/augment augment elastic_options outpaint surrogates
public core/carry carry carry_views confidence dense_points plane_sweep view_color view_propagation fusion
public core/colorizer colorizer corrector scene_batch personal/scene_colorizers personal/train_colorizer
public core/encoder encoder image_tensors tap_encoder torch_errors torch_threads weight_digest \
  weight_tensors clip/clip convnext/convnext convnext/convnext_config convnext/convnext_weights \
  embedded/embedded_weights
public core/grid edge_weights grid_solver quick_grid
public core/image box_mean codec crop decode_budget draw fill_holes feature_matches flow_agreement guided_upsample image_checks local_features optical_flow plane_sampling quick_png reduced weighted_resize \
  credit/caption credit/picture_credit probe/focal_length probe/orientation probe/probe
public core/keycolor edit_model from_image picture_checks recolor automatic/automatic external/remote \
  external/script hints/hint_layer hints/hint_map hints/hints references/reference words/prompt
public core/film anchor_frames film_carry moving_regions returning_shots shots steady_colors steady_tones
public core/keyview collect_features coverage expected_error select tracks view_features
public core/metrics confidence_interval scene_consistency temporal_consistency view_scores
public core/report contact_sheet curves report_page run_curve scene_plan
public core/scene camera frame_numbers frame_times import_options key_photo lens photo_masks relief scene \
  view_images formats/camera_file formats/camera_films import/hold_out import/import \
  masks/masked_points masks/still_regions
public core/splat model/gaussian_cap model/gaussian_model model/memory_plan motion/geometry_in_time raster/render \
  geometry/geometry_options geometry/geometry_trainer geometry/warm_up chroma/chroma_adjustment chroma/chroma_fit chroma/chroma_options \
  export/export export/motion/playable_scene export/glb/glb export/rgb_refine export/sog/sog export/splat4d/splat4d export/spz/spz import/splat_scene \
  training/hexplane_training
public core/stage idle_stages run_stages film_import/import_film formats/artifact_io options/[a-z_]+
public core/trace span trace_context trace_settings tracer
public core/video film_reader mp4_writer sound_offset ticks
public core/view view_page path/camera_path
public core/weights safetensors weight_file weight_map weight_reader
public server/access access_key_file certificate_roles notify_targets tls tokens
public server/backends backend_address backend_prober grpc_colorizer
public server/keeping backup fsck
public server/metrics server_metrics
public server/notify notifier webhook
public server/planning asked_formats job_plan job_spec key_view_jobs plan_scenes planner presets scene_facts spec_check spec_names stage_key time_budget
public server/rpc calls/error_mapping calls/worker_messages rpc_server
public server/storage ballast blob_cache blob_store collector data_folder disk_space file_blob_store upload_store worker_blobs s3/s3_blob_store s3/s3_check
public server/store chore_store client_store job job_store open_store project_store shared_job_logs worker_store sqlite_job_store postgresql/copy_store store_file user_models
public server/tracing job_spans
public server/worker supervision/supervisor supervision/worker_settings

# Branches on the kind of a capture belong to its tables (core/catalogue/captures) and to import, which
# determines the kind. Other sources read a property of it on at most this many lines each; lower a
# number when it falls, and do not raise it: a new kind is a row, not a new branch.
kind_branches='
client/commands/colorize.cc 1
core/stage/carry_color.cc 1
core/stage/colorize_scene.cc 2
core/stage/evaluate.cc 1
core/stage/movie/film_clock.cc 1
core/stage/recolor/time_ranges.cc 1
core/stage/render.cc 1
core/stage/report/next_key_view.cc 1
core/stage/select_key_view.cc 1
server/planning/colorize_scene_graph.cc 1
server/planning/scene_facts.h 3
server/planning/time_budget.cc 4
server/rpc/scenes/scene_validation.cc 2
server/worker/stage_runner.cc 1
'
pattern='capture\(\)|ColoredAs\(|\<(is_reconstructed|is_dynamic)\>|([!=]=|case) (Capture(Kind|Layout)|ViewSource|PoseSource)::'
branches=$(grep -rnE "$pattern" core server client --include='*.h' --include='*.cc' |
  grep -vE '^[^:]*_test\.cc:|^core/(catalogue/captures|scene/(scene|scene_json|import/[a-z_]+)|stage/(film_import/[a-z_]+|import_scene|formats/artifact_io))\.(h|cc):' || true)
for file in $(cut -d: -f1 <<<"$branches" | sort -u); do
  most=$(awk -v file="$file" '$1 == file { print $2 }' <<<"$kind_branches")
  lines=$(grep "^$file:" <<<"$branches")
  [ "$(wc -l <<<"$lines")" -le "${most:-0}" ] ||
    complain "$file branches on the kind of a capture more than ${most:-0} times:" "$lines"
done

if [ "$failed" -ne 0 ]; then exit 1; fi
echo "check_layers: ok"
