#include "client/options/colorize_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <system_error>

#include "client/lib/blob_transfer.h"
#include "client/lib/scene_upload.h"
#include "client/options/option_fields.h"
#include "client/options/preset_file.h"
#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/catalogue/limits.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

// Options with a flag of their own; all others are set by --set.
struct OptionFlag {
  const char* flag;
  const char* option;
  const char* help;
};
constexpr OptionFlag kOptionFlags[] = {
    {"--max-side", "max_side_px", "Longer side of the working pictures"},
    {"--geometry-iterations",
     "reconstruct_geometry.iterations",
     "Training iterations of the luminance Gaussians"},
    {"--max-gaussians", "reconstruct_geometry.max_gaussians", "Maximum number of Gaussians"},
    {"--colorizer-iterations",
     "personalize.iterations",
     "Training iterations of the scene's colorizer"},
    {"--augment",
     "generate_augmentations.samples",
     "Number of pictures generated from the key view as additional training data (paper: 8)"},
    {"--augment-backend",
     "generate_augmentations.backend",
     "Model server that generates these pictures"},
    {"--chroma-iterations",
     "solve_chroma.iterations",
     "Iterations of the chroma solver after its closed-form start"},
};

// Returns why a setting is refused, or an empty string.
std::string SettingError(const std::string& setting) {
  v1::ColorizeSceneSpec spec;
  try {
    SetOption(setting, &spec);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

void DeclareOptionFlags(CLI::App& app, ColorizeOptions* o) {
  for (const OptionFlag& flag : kOptionFlags) {
    const std::string name = flag.option;
    app.add_option_function<std::string>(
           flag.flag,
           [o, name](const std::string& value) { o->settings.push_back(name + "=" + value); },
           fmt::format("{} ({})", flag.help, DescribeOption(name)))
        ->check([name](const std::string& value) { return SettingError(name + "=" + value); });
  }
  app.add_flag_callback(
      "--augment-files",
      [o] { o->settings.push_back("generate_augmentations.files=true"); },
      "Also train the colorizer on the coloured pictures in PHOTOS/augment/");
  app.add_flag_callback(
      "--png",
      [o] { o->settings.push_back("render.pictures=true"); },
      "Films and dynamic scenes only: also write each frame in colour and full size to "
      "OUT/film_frames/");
  app.add_option_function<std::vector<std::string>>(
         "--set",
         [o](const std::vector<std::string>& settings) {
           o->settings.insert(o->settings.end(), settings.begin(), settings.end());
         },
         "STAGE.OPTION=VALUE: set an option of a stage, e.g. carry_color.depth_tolerance=0.05; "
         "`--set STAGE` lists its options. May be repeated")
      ->allow_extra_args(false)
      ->check(SettingError);
}

// Flags of the import.
void DeclareImportFlags(CLI::App& app, ColorizeOptions* o) {
  app.add_flag("--hold-out", o->hold_out, "Hold out every eighth view for evaluation");
  app.add_flag("--deflicker", o->deflicker, "Films only: remove flicker of exposure");
  app.add_flag(
      "--poses",
      o->poses,
      "Films of one camera only: estimate the poses of a moving camera from the static "
      "background, or assume the depth before a standing one (2.5D). Poses of several cameras are "
      "always estimated");
}

std::string ImportSettingError(const std::string& setting) {
  if (!setting.starts_with(kind::kImportScene)) {
    return "'" + setting +
           "' is not an option of the import (import_scene.OPTION=VALUE); options of other stages "
           "belong to `color3d colorize`";
  }
  return SettingError(setting);
}

// Options from preset, file, settings and --poses, without the other flags of this command.
v1::ColorizeSceneSpec RequestedOptions(const ColorizeOptions& options) {
  v1::ColorizeSceneSpec spec = ReadPreset(options.preset);
  for (const std::string& setting : options.settings) SetOption(setting, &spec);
  if (options.poses) {
    spec.mutable_import_scene()->set_film_poses(v1::ImportSceneSpec::FILM_POSES_AUTO);
  }
  return spec;
}

fs::path Canonical(const fs::path& path) {
  std::error_code error;
  const fs::path canonical = fs::weakly_canonical(fs::absolute(path), error);
  return error ? fs::absolute(path) : canonical;
}

// "a/b/" and "a/b" are the same folder.
bool IsWithin(const fs::path& path, const fs::path& folder) {
  const fs::path relative = path.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

}  // namespace

void ColorizeOptions::Check() const {
  if (!masks.empty() && film) {
    throw InvalidArgument(
        "--masks is for photos of a static scene; --film takes frames as they are");
  }
  if (!masks.empty() && photos.empty()) {
    throw InvalidArgument("--masks needs PHOTOS; a stored scene has its masks already");
  }
  if (photos.empty() == scene.empty()) {
    throw InvalidArgument(photos.empty() ? "give a folder of photos, or --scene scenes/ID"
                                         : "PHOTOS and --scene exclude each other: the scene has "
                                           "its photos already");
  }
  if (benchmark && photos.empty()) {
    throw InvalidArgument("--benchmark needs the folder of the photos in colour, not --scene");
  }
  if (bound && !benchmark) {
    throw InvalidArgument("--bound needs --benchmark");
  }
  if (!colorizer.empty() && !IsFile(colorizer)) {
    throw Error(ErrorCode::kNotFound,
                "--colorizer: there is no file {}; give colorizer.c3c of the results of a scene",
                colorizer);
  }
  RequestedOptions(*this);  // throws if the file of the preset cannot be read
  color.Check();
  if (keys > 1 && !benchmark) {
    throw InvalidArgument(
        "--keys needs --benchmark, where photos have true colours. To colour several photos, see "
        "`color3d key select --count` and --add-key-view");
  }
  if (keys > 1 && (!additional_key_views.empty() || color.HasSource())) {
    throw InvalidArgument(
        "--keys chooses the key views and takes their true colours; leave out {}",
        additional_key_views.empty() ? "the other source of colour" : "--add-key-view");
  }
  if (additional_key_views.size() > size_t{kMaxAdditionalKeyViews}) {
    throw InvalidArgument("--add-key-view is given {} times; at most {} are taken",
                          additional_key_views.size(),
                          kMaxAdditionalKeyViews);
  }
  for (const std::string& text : additional_key_views) ParseAdditionalKeyView(text);
  // A picture of a certain view cannot be scored against that view.
  const bool for_one_view = !color.PictureOfView().empty() || !color.mask.empty();
  if (benchmark && for_one_view) {
    throw InvalidArgument(
        "--benchmark colours the key view with its own true colours, or by --auto, --prompt, "
        "--reference, --backend or --script; leave out the picture of the key view");
  }
}

void AddKeyViews(Connection& connection,
                 const ColorizeOptions& options,
                 v1::ColorizeSceneSpec* spec) {
  for (const std::string& text : options.additional_key_views) {
    const AdditionalKeyView key = ParseAdditionalKeyView(text);
    v1::FurtherKeyView* added = spec->mutable_carry_color()->add_further_key_views();
    added->set_view(key.view);
    *added->mutable_color() = UploadKeyColor(connection, key.color);
    if (key.begin_s) added->set_begin_s(*key.begin_s);
    if (key.end_s) added->set_end_s(*key.end_s);
  }
}

void AddColorizer(Connection& connection,
                  const ColorizeOptions& options,
                  v1::ColorizeSceneSpec* spec) {
  if (options.colorizer.empty()) return;
  const UploadFile upload{options.colorizer, DigestFile(options.colorizer)};
  UploadMissing(connection, {upload}, [](int64_t, int64_t) {});
  *spec->mutable_personalize()->mutable_colorizer() = ToProto(upload.digest);
}

bool WantsAugmentFiles(const ColorizeOptions& options) {
  return RequestedOptions(options).generate_augmentations().files();
}

void RequireAugmentFiles(const ColorizeOptions& options, const PhotoFolder& folder) {
  if (!WantsAugmentFiles(options) || !folder.augment_files.empty()) return;
  throw InvalidArgument(
      "--augment-files: there are no pictures in {}; put coloured pictures of the scene there, or "
      "omit the flag",
      (folder.root / "augment").string());
}

void DeclareOptions(CLI::App& app, ColorizeOptions* o) {
  app.add_option(
      "PHOTOS",
      o->photos,
      "Folder of photos; or folder with images/ and COLMAP models (sparse/0, ...; the model with "
      "most photos is used; dynamic scenes with times.txt, a line SECONDS NAME for each photo); "
      "or folder with photos and transforms.json (or transforms_train.json, ...) or "
      "poses_bounds.npy; or a splat (.ply, .sog, .spz); or a film (.mp4, .mov, .mkv, ...)");
  app.add_option(
      "--scene",
      o->scene,
      "In place of PHOTOS: name of a scene on the server, to be coloured from its accepted key "
      "view (`color3d key accept`)");
  app.add_option("--masks",
                 o->masks,
                 "Folder of PNG masks named like the photos (a.png or a.jpg.png): white is used, "
                 "black is ignored. PNG photos with alpha need no masks");
  app.add_option("-o,--out", o->out, "Folder for the results")->required();
  DeclareKeyColorFlags(app, &o->color);
  app.add_option(
      "--key-view", o->key_view, "Name of the key view's photo; default: selected automatically");
  const auto add_key_views = [o](const std::vector<std::string>& views) {
    o->additional_key_views.insert(o->additional_key_views.end(), views.begin(), views.end());
  };
  app.add_option_function<std::vector<std::string>>(
      "--add-key-view",
      add_key_views,
      "VIEW=COLOURED.png: an additional key view, for the parts that those before it do not show; "
      "their colours are kept. In a film it colours the frames that are nearest to it; "
      "VIEW=COLOURED.png@10-14.5 recolours seconds 10 to 14.5 and no other frame. May be repeated");
  app.add_option_function<std::vector<std::string>>("--more-key", add_key_views)
      ->group("");  // the former name
  app.add_option("--preset",
                 o->preset,
                 fmt::format("Trade-off between time and quality: {}; or a preset file (`color3d "
                             "server presets NAME` prints one to start from)",
                             PresetNames()))
      ->capture_default_str();
  app.add_option("--time-budget",
                 o->time_budget_seconds,
                 "Shorten the schedules of the preset to end in about this time, e.g. 90s, 5m, 1h")
      ->transform(CLI::AsNumberWithUnit(
          std::map<std::string, double>{{"s", 1.0}, {"m", 60.0}, {"h", 3600.0}}));
  app.add_flag(
      "--benchmark",
      o->benchmark,
      "Remove the colour of coloured photos or a coloured film, and score the result against it");
  app.add_option(
         "--keys",
         o->keys,
         "With --benchmark: number of key views, chosen together, each with its true colours")
      ->check(CLI::Range(1, kMaxAdditionalKeyViews + 1))
      ->capture_default_str();
  app.add_flag("--bound",
               o->bound,
               "With --benchmark: also score the same geometry with the true colours of all views");
  app.add_option("--colorizer",
                 o->colorizer,
                 "Use the colorizer of another scene (colorizer.c3c of its results) in place of "
                 "training one: a baseline");
  app.add_option(
      "--encoder", o->encoder, "Name of the weights of the frozen encoder on the server");
  app.add_flag(
      "--film",
      o->film,
      "Treat the photos as frames of a film, coloured one by one; folders of frames are films "
      "of several cameras, reconstructed as one dynamic scene");
  DeclareImportFlags(app, o);
  app.add_flag("--detach", o->detach, "Return once the job is submitted");
  AddSubmissionFlags(app, &o->submission);
  app.add_option(
      "--seed", o->seed, "Seed; the same seed gives the same result on the same machine");
  DeclareOptionFlags(app, o);
}

void DeclareImportOptions(CLI::App& app, ColorizeOptions* o) {
  DeclareImportFlags(app, o);
  app.add_option("--set",
                 o->settings,
                 "import_scene.OPTION=VALUE: set an option of the import, e.g. "
                 "import_scene.film_stride=2; `--set import_scene` lists them. May be repeated")
      ->allow_extra_args(false)
      ->check(ImportSettingError);
}

v1::JobSpec CommonSpec(const ColorizeOptions& options, const std::string& scene) {
  v1::JobSpec spec;
  spec.set_scene(scene);
  spec.set_seed(options.seed);
  return spec;
}

v1::JobSpec ImportSpec(const ColorizeOptions& options, const std::string& scene) {
  v1::JobSpec spec = CommonSpec(options, scene);
  v1::ImportSceneSpec* import_scene = spec.mutable_import_scene();
  *import_scene = RequestedOptions(options).import_scene();
  if (options.hold_out || options.benchmark) import_scene->set_hold_out_every_eighth(true);
  if (options.deflicker) import_scene->set_film_deflicker(true);
  return spec;
}

v1::ColorizeSceneSpec MergeWithPreset(Connection& connection, const ColorizeOptions& options) {
  const v1::ColorizeSceneSpec chosen = RequestedOptions(options);
  v1::ColorizeSceneSpec spec;
  const v1::ServerInfo info = GetServerInfo(connection);
  for (const v1::PresetInfo& preset : info.presets()) {
    if (preset.options().preset() == std::max(chosen.preset(), v1::PRESET_FAST)) {
      spec = preset.options();
    }
  }
  spec.MergeFrom(chosen);
  return spec;
}

v1::JobSpec GeometrySpec(Connection& connection,
                         const ColorizeOptions& options,
                         const std::string& scene) {
  const v1::ColorizeSceneSpec chosen = MergeWithPreset(connection, options);
  v1::JobSpec spec = CommonSpec(options, scene);
  *spec.mutable_reconstruct_geometry() = chosen.reconstruct_geometry();
  if (!chosen.reconstruct_geometry().has_max_side_px()) {
    spec.mutable_reconstruct_geometry()->set_max_side_px(chosen.max_side_px());
  }
  return spec;
}

v1::JobSpec SelectSpec(Connection& connection,
                       const ColorizeOptions& options,
                       const std::string& scene) {
  const v1::ColorizeSceneSpec chosen = RequestedOptions(options);
  v1::JobSpec spec = CommonSpec(options, scene);
  v1::SelectKeyViewSpec* select = spec.mutable_select_key_view();
  // A job of one stage uses the default preset anyway.
  *select = chosen.preset() > v1::PRESET_FAST
                ? MergeWithPreset(connection, options).select_key_view()
                : chosen.select_key_view();
  if (!options.encoder.empty()) select->set_encoder(options.encoder);
  if (options.keys > 1) select->set_count(options.keys);
  if (!options.key_view.empty()) {
    select->set_strategy(v1::SelectKeyViewSpec::STRATEGY_MANUAL);
    select->set_view(options.key_view);
  }
  return spec;
}

v1::JobSpec ColorizeSpec(const ColorizeOptions& options, const std::string& scene) {
  v1::JobSpec spec = CommonSpec(options, scene);
  v1::ColorizeSceneSpec* colorize = spec.mutable_colorize_scene();
  *colorize = RequestedOptions(options);
  if (!options.encoder.empty()) {
    colorize->mutable_select_key_view()->set_encoder(options.encoder);
    colorize->mutable_personalize()->set_encoder(options.encoder);
  }
  if (options.time_budget_seconds > 0.0) {
    colorize->set_time_budget_seconds(options.time_budget_seconds);
  }
  if (options.hold_out || options.benchmark) {
    colorize->mutable_import_scene()->set_hold_out_every_eighth(true);
  }
  if (options.deflicker) colorize->mutable_import_scene()->set_film_deflicker(true);
  return spec;
}

void RequireSeparateOutFolder(const fs::path& out, const PhotoFolder& folder) {
  const fs::path folder_out = Canonical(out);
  bool inside = false;
  for (const LocalFile& photo : folder.photos) {
    inside = inside || Canonical(photo.file.parent_path()) == folder_out;
    // images/ is searched recursively.
    inside = inside || (photo.path.starts_with("images/") &&
                        IsWithin(folder_out, Canonical(folder.root / "images")));
    if (inside) break;
  }
  if (!inside) return;
  throw InvalidArgument(
      "-o {} is the folder of the photos: the next run would take the results for photos; "
      "name another folder",
      out.string());
}

}  // namespace color3d::client
