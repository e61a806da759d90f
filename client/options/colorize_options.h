// Options of `color3d colorize`, their validation, and conversion to job specs.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"
#include "client/options/additional_key_view.h"
#include "client/options/key_color_flags.h"
#include "client/options/submission.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

struct ColorizeOptions {
  std::string photos;  // folder; empty: `scene` is set
  std::string scene;   // "scenes/ID"; its accepted key view is used
  std::string out;
  KeyColorFlags color;
  std::string masks;                              // folder; empty: none
  std::vector<std::string> additional_key_views;  // ParseAdditionalKeyView; in order of importance
  std::string key_view;                           // view name or stem; empty: selected
  std::string colorizer;        // file of another scene's colorizer; empty: trained
  std::string encoder;          // name of weights on the server; empty: the embedded encoder
  std::string preset = "fast";  // name of a preset, or a preset file
  bool film = false;            // the photos are frames of a film
  bool deflicker = false;       // films only: remove flicker of exposure
  bool poses = false;           // films only: estimate poses
  bool benchmark = false;
  int keys = 1;        // benchmark only: number of key views, chosen together
  bool bound = false;  // benchmark only: also score the geometry with all true colours
  bool detach = false;
  Submission submission;
  bool hold_out = false;
  uint64_t seed = 0;                  // 0: the server's default
  double time_budget_seconds = 0.0;   // 0: none
  std::vector<std::string> settings;  // "stage.field=value", override the preset

  // Checks that need no server. Throws Error if options exclude each other or files cannot be read.
  void Check() const;
};

// Uploads the pictures of the additional key views and names them in the spec.
void AddKeyViews(Connection& connection,
                 const ColorizeOptions& options,
                 v1::ColorizeSceneSpec* spec);

// Uploads the colorizer of another scene, if one is given, and names it in the spec.
void AddColorizer(Connection& connection,
                  const ColorizeOptions& options,
                  v1::ColorizeSceneSpec* spec);

// Returns whether flags, settings or preset file request the pictures in PHOTOS/augment/.
bool WantsAugmentFiles(const ColorizeOptions& options);
// Throws Error{kInvalidArgument} if they are requested but missing.
void RequireAugmentFiles(const ColorizeOptions& options, const PhotoFolder& folder);

void DeclareOptions(CLI::App& app, ColorizeOptions* options);
// Declares the options that ImportSpec reads, for commands that only import a scene.
void DeclareImportOptions(CLI::App& app, ColorizeOptions* options);

// Returns a spec with scene and seed but no stage.
v1::JobSpec CommonSpec(const ColorizeOptions& options, const std::string& scene);
v1::JobSpec ImportSpec(const ColorizeOptions& options, const std::string& scene);
// Returns the spec of the geometry job that the colorize job of the scene will need, so that the
// result can be reused.
v1::JobSpec GeometrySpec(Connection& connection,
                         const ColorizeOptions& options,
                         const std::string& scene);
// Selects the key view by the strategy of the preset, or `options.key_view`; `options.keys` views.
v1::JobSpec SelectSpec(Connection& connection,
                       const ColorizeOptions& options,
                       const std::string& scene);
// Returns everything except key view, key colour and truth. Throws if the preset file is invalid.
v1::JobSpec ColorizeSpec(const ColorizeOptions& options, const std::string& scene);

// Throws Error{kInvalidArgument} if the next run would take results in `out` for photos.
void RequireSeparateOutFolder(const std::filesystem::path& out, const PhotoFolder& folder);

}  // namespace color3d::client
