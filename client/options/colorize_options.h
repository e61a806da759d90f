// Options of `color3d colorize`, their checks, and the job specs that they mean.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"
#include "client/options/key_color_flags.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

struct ColorizeOptions {
  std::string photos;  // folder; empty: `scene` is set
  std::string scene;   // "scenes/ID", whose accepted key view is used
  std::string out;
  KeyColorFlags color;
  std::string masks;                              // folder; empty: none
  std::vector<std::string> additional_key_views;  // ParseAdditionalKeyView; in order of importance
  std::string key_view;                           // view name or stem; empty: selected
  std::string encoder;  // weights by name in the server's configuration; empty: the embedded one
  std::string preset = "fast";  // of the server's, or a file of the user's own
  bool film = false;            // the photos are frames of a film
  bool deflicker = false;       // its exposure is made steady
  bool poses = false;           // of a film: its frames' poses are looked for
  bool benchmark = false;
  int keys = 1;        // of the benchmark: key views in their true colours, chosen together
  bool bound = false;  // of the benchmark: upload all true colours, and score what they would give
  bool detach = false;
  std::string notify;  // address that is told when the job has ended; empty: none
  bool hold_out = false;
  uint64_t seed = 0;                  // 0: the server's default
  double time_budget_seconds = 0.0;   // 0: none
  std::vector<std::string> settings;  // "stage.field=value", over what the preset says

  // What can be said without the server: throws Error when options do not go together or files
  // cannot be read.
  void Check() const;
};

// An additional key view: the photo's name and the source of its colour.
struct AdditionalKeyView {
  std::string view;
  KeyColorFlags color;
  // Films only: the range of time that it recolours, seconds; either end may be open.
  std::optional<double> begin_s = {};
  std::optional<double> end_s = {};
  bool HasRange() const { return begin_s || end_s; }
};
// "VIEW=COLOURED.png", "VIEW=POINTS.json" or "VIEW=auto", and "@BEGIN-END" behind it or not. Throws
// Error{kInvalidArgument} for other text, and what checking the file throws.
AdditionalKeyView ParseAdditionalKeyView(const std::string& text);

// Uploads the pictures of the additional key views and names them in the spec.
void AddKeyViews(Connection& connection,
                 const ColorizeOptions& options,
                 v1::ColorizeSceneSpec* spec);

// Whether the pictures in PHOTOS/augment/ are asked for, by flag, setting or preset file.
bool WantsAugmentFiles(const ColorizeOptions& options);
// Throws Error{kInvalidArgument} when they are and there are none.
void RequireAugmentFiles(const ColorizeOptions& options, const PhotoFolder& folder);

void DeclareOptions(CLI::App& app, ColorizeOptions* options);
// Those that ImportSpec reads, for commands that come before the scene is coloured.
void DeclareImportOptions(CLI::App& app, ColorizeOptions* options);

// A spec with scene and seed, and no stage yet.
v1::JobSpec CommonSpec(const ColorizeOptions& options, const std::string& scene);
v1::JobSpec ImportSpec(const ColorizeOptions& options, const std::string& scene);
// The geometry that the scene's own job will make, so that it finds it made.
v1::JobSpec GeometrySpec(Connection& connection,
                         const ColorizeOptions& options,
                         const std::string& scene);
// The key view by the preset's strategy, or `options.key_view`; `options.keys` of them.
v1::JobSpec SelectSpec(Connection& connection,
                       const ColorizeOptions& options,
                       const std::string& scene);
// Everything but key view, key colour and truth. Throws what reading the preset's file throws.
v1::JobSpec ColorizeSpec(const ColorizeOptions& options, const std::string& scene);

// Throws Error{kInvalidArgument} when results in `out` would be taken for photos by the next run.
void RequireOutBesidePhotos(const std::filesystem::path& out, const PhotoFolder& folder);

}  // namespace color3d::client
