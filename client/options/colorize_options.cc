#include "client/options/colorize_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <string_view>
#include <system_error>

#include "client/options/option_fields.h"
#include "client/options/preset_file.h"
#include "core/base/error.h"
#include "core/catalogue/limits.h"
#include "core/catalogue/stages.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

// Options with a flag of their own; the rest is reached by --set.
struct OptionFlag {
  const char* flag;
  const char* option;
  const char* help;
};
constexpr OptionFlag kOptionFlags[] = {
    {"--max-side", "max_side_px", "Longer side of the working pictures"},
    {"--geometry-iterations", "reconstruct_geometry.iterations", "Of luminance Gaussians"},
    {"--max-gaussians", "reconstruct_geometry.max_gaussians", "Hard cap"},
    {"--colorizer-iterations", "personalize.iterations", "Of the scene's colorizer"},
    {"--augment",
     "generate_augmentations.samples",
     "Pictures made from the key view that the colorizer learns from, too (the paper: 8)"},
    {"--augment-backend", "generate_augmentations.backend", "Model server that makes them"},
    {"--chroma-iterations", "solve_chroma.iterations", "After the closed-form start"},
};

// Why a setting cannot be made; empty: it can.
std::string Complaint(const std::string& setting) {
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
        ->check([name](const std::string& value) { return Complaint(name + "=" + value); });
  }
  app.add_flag_callback(
      "--augment-files",
      [o] { o->settings.push_back("generate_augmentations.files=true"); },
      "The colorizer learns from the coloured pictures in PHOTOS/augment/, too");
  app.add_flag_callback(
      "--png",
      [o] { o->settings.push_back("render.pictures=true"); },
      "Of a film, and of cameras that filmed a scene: every frame in colour as a picture, too, at "
      "its full size and under its name (OUT/film_frames/)");
  app.add_option_function<std::vector<std::string>>(
         "--set",
         [o](const std::vector<std::string>& settings) {
           o->settings.insert(o->settings.end(), settings.begin(), settings.end());
         },
         "STAGE.OPTION=VALUE: any option of a stage, e.g. carry_color.depth_tolerance=0.05; `--set "
         "STAGE` names its options. May be repeated")
      ->allow_extra_args(false)
      ->check(Complaint);
}

// What the import of the photos is asked for.
void DeclareImportFlags(CLI::App& app, ColorizeOptions* o) {
  app.add_flag("--hold-out", o->hold_out, "Hold out every eighth view");
  app.add_flag("--deflicker",
               o->deflicker,
               "Take flicker of exposure out of a film; the coloured frames get steady luminance");
  app.add_flag(
      "--poses",
      o->poses,
      "Of a film by one moving camera: find the frames' poses by what stands still; of one that "
      "stands, assume depth (2.5D) (those of "
      "several are found anyway)");
}

std::string ComplaintOfImport(const std::string& setting) {
  if (!setting.starts_with(kind::kImportScene)) {
    return "'" + setting +
           "' is no option of the import (import_scene.OPTION=VALUE); other stages have theirs "
           "from "
           "`color3d colorize`";
  }
  return Complaint(setting);
}

// What preset, file and settings say, and --poses, before the other flags of this command.
v1::ColorizeSceneSpec Chosen(const ColorizeOptions& options) {
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

// "a/b/" and "a/b" are one folder.
bool IsWithin(const fs::path& path, const fs::path& folder) {
  const fs::path relative = path.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

}  // namespace

void ColorizeOptions::Check() const {
  if (!masks.empty() && film) {
    throw InvalidArgument("--masks is for photos of a place; --film takes frames as they are");
  }
  if (!masks.empty() && photos.empty()) {
    throw InvalidArgument("--masks belongs to PHOTOS; a stored scene has its masks already");
  }
  if (photos.empty() == scene.empty()) {
    throw InvalidArgument(photos.empty() ? "give a folder of photos, or --scene scenes/ID"
                                         : "PHOTOS and --scene do not go together: the scene has "
                                           "its photos already");
  }
  if (benchmark && photos.empty()) {
    throw InvalidArgument("--benchmark needs the folder of the photos in colour, not --scene");
  }
  if (bound && !benchmark) {
    throw InvalidArgument("--bound is a part of the score; it needs --benchmark");
  }
  Chosen(*this);  // the preset's file can be read
  color.Check();
  if (keys > 1 && !benchmark) {
    throw InvalidArgument(
        "--keys is a part of the score, where photos have true colours; it needs --benchmark. To "
        "colour several photos, see `color3d key select --count` and --add-key-view");
  }
  if (keys > 1 && (!additional_key_views.empty() || color.Given())) {
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
  // What is drawn for a view that is known beforehand cannot be scored against that view.
  const bool for_one_view = !color.FileOfView().empty() || !color.mask.empty();
  if (benchmark && for_one_view) {
    throw InvalidArgument(
        "--benchmark colours the key view with its own true colours, or by --auto, --prompt, "
        "--reference, --backend or --script; leave out the picture of the key view");
  }
}

namespace {

// "10-14.5", "10-" or "-14.5"; false for other text.
bool ParseRange(std::string_view text, AdditionalKeyView* key) {
  const auto seconds = [](std::string_view number, std::optional<double>* to) {
    if (number.empty()) return true;
    double value = 0.0;
    const auto [end, error] = std::from_chars(
        number.data(), number.data() + number.size(), value, std::chars_format::fixed);
    *to = value;
    return error == std::errc() && end == number.data() + number.size();
  };
  const size_t dash = text.find('-');
  return dash != std::string_view::npos && seconds(text.substr(0, dash), &key->begin_s) &&
         seconds(text.substr(dash + 1), &key->end_s) && key->HasRange();
}

// Takes the range of time off the end of `value`, where it has one. A file may be called
// "a@2x.png".
void TakeRange(std::string* value, AdditionalKeyView* key) {
  const size_t at = value->rfind('@');
  if (at == std::string::npos) return;
  const std::string range = value->substr(at + 1);
  if (range.find_first_not_of("0123456789.-") != std::string::npos) return;
  if (!ParseRange(range, key)) {
    throw InvalidArgument(
        "--add-key-view {}: '{}' is no range of time; write seconds of the film, BEGIN-END, e.g. "
        "@10-14.5, or @10- for up to its end",
        key->view,
        "@" + range);
  }
  if (key->begin_s && key->end_s && *key->end_s < *key->begin_s) {
    throw InvalidArgument(
        "--add-key-view {}: the range of time ends at {} s, before it begins at {} s",
        key->view,
        *key->end_s,
        *key->begin_s);
  }
  value->resize(at);
}

}  // namespace

AdditionalKeyView ParseAdditionalKeyView(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw InvalidArgument(
        "--add-key-view wants VIEW=COLOURED.png, the name of a photo and its coloured picture (or "
        "VIEW=POINTS.json, VIEW=auto), of a film also VIEW=COLOURED.png@BEGIN-END, in seconds; "
        "'{}' "
        "is not of that form",
        text);
  }
  std::string value = text.substr(equals + 1);
  AdditionalKeyView key{text.substr(0, equals), {}};
  TakeRange(&value, &key);
  if (value == "auto") {
    key.color.automatic = true;
  } else if (fs::path(value).extension() == ".json") {
    key.color.hints = value;
  } else {
    key.color.image = value;
  }
  try {
    key.color.Check();
  } catch (const Error& e) {
    throw Error(e.code(), "--add-key-view {}: {}", key.view, e.what());
  }
  return key;
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

bool WantsAugmentFiles(const ColorizeOptions& options) {
  return Chosen(options).generate_augmentations().files();
}

void RequireAugmentFiles(const ColorizeOptions& options, const PhotoFolder& folder) {
  if (!WantsAugmentFiles(options) || !folder.augment_files.empty()) return;
  throw InvalidArgument(
      "--augment-files: there is no picture in {}; put coloured pictures of the scene there, or "
      "leave the flag out",
      (folder.root / "augment").string());
}

void DeclareOptions(CLI::App& app, ColorizeOptions* o) {
  app.add_option(
      "PHOTOS",
      o->photos,
      "Folder of photos, or one with images/ and COLMAP models (sparse/0, ...: the one with "
      "most photos is used; of a scene that moves with times.txt, a line SECONDS NAME "
      "for each photo), or with transforms.json (or transforms_train.json, ...) or "
      "poses_bounds.npy and its photos; or a splat (.ply, .sog, .spz); or a film (.mp4, "
      ".mov, .mkv, ...), whose frames are coloured");
  app.add_option("--scene",
                 o->scene,
                 "In place of PHOTOS: a scene that the server holds, coloured from the key view "
                 "that `color3d key accept` has accepted");
  app.add_option("--masks",
                 o->masks,
                 "Folder of masks, PNG, called like the photos (a.png or a.jpg.png): white counts, "
                 "black is ignored. PNG photos with alpha need none");
  app.add_option("-o,--out", o->out, "Folder for the results")->required();
  DeclareKeyColorFlags(app, &o->color);
  app.add_option("--key-view", o->key_view, "Photo that is the key view; default: selected");
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
                 fmt::format("How much time quality is worth: {}; or a file of your own (`color3d "
                             "server presets NAME` prints one to start from)",
                             PresetNames()))
      ->capture_default_str();
  app.add_option("--time-budget",
                 o->time_budget_seconds,
                 "Shorten the preset's schedules to end in about this time: 90s, 5m, 1h")
      ->transform(CLI::AsNumberWithUnit(
          std::map<std::string, double>{{"s", 1.0}, {"m", 60.0}, {"h", 3600.0}}));
  app.add_flag("--benchmark",
               o->benchmark,
               "Photos or a film in colour: drop the colour and score against it");
  app.add_option("--keys",
                 o->keys,
                 "With --benchmark: so many key views, chosen together, each in its true colours")
      ->check(CLI::Range(1, kMaxAdditionalKeyViews + 1))
      ->capture_default_str();
  app.add_flag(
      "--bound",
      o->bound,
      "With --benchmark: also score the same geometry under the true colours of all views");
  app.add_option("--encoder", o->encoder, "Weights of the frozen encoder that this server knows");
  app.add_flag("--film",
               o->film,
               "The photos are frames of a film: coloured one by one, not reconstructed; folders "
               "of them are "
               "of several cameras: one scene that moves");
  DeclareImportFlags(app, o);
  app.add_flag("--detach", o->detach, "Return when the job is submitted");
  app.add_option("--notify",
                 o->notify,
                 "Address that is told when the job has ended; the server's operator allows which");
  app.add_option("--seed", o->seed, "Same seed, same machine: same result");
  DeclareOptionFlags(app, o);
}

void DeclareImportOptions(CLI::App& app, ColorizeOptions* o) {
  DeclareImportFlags(app, o);
  app.add_option("--set",
                 o->settings,
                 "import_scene.OPTION=VALUE: any option of the import, e.g. "
                 "import_scene.film_stride=2; `--set import_scene` names them. May be repeated")
      ->allow_extra_args(false)
      ->check(ComplaintOfImport);
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
  *import_scene = Chosen(options).import_scene();
  if (options.hold_out || options.benchmark) import_scene->set_hold_out_every_eighth(true);
  if (options.deflicker) import_scene->set_film_deflicker(true);
  return spec;
}

v1::ColorizeSceneSpec OverItsPreset(Connection& connection, const ColorizeOptions& options) {
  const v1::ColorizeSceneSpec chosen = Chosen(options);
  v1::ColorizeSceneSpec spec;
  const auto info = connection.Call(
      &v1::ServerService::Stub::GetServerInfo, connection.server(), v1::GetServerInfoRequest());
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
  const v1::ColorizeSceneSpec chosen = OverItsPreset(connection, options);
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
  const v1::ColorizeSceneSpec chosen = Chosen(options);
  v1::JobSpec spec = CommonSpec(options, scene);
  v1::SelectKeyViewSpec* select = spec.mutable_select_key_view();
  // A job of one stage takes the default preset by itself.
  *select = chosen.preset() > v1::PRESET_FAST ? OverItsPreset(connection, options).select_key_view()
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
  *colorize = Chosen(options);
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

void RequireOutBesidePhotos(const fs::path& out, const PhotoFolder& folder) {
  const fs::path folder_out = Canonical(out);
  bool inside = false;
  for (const LocalFile& photo : folder.photos) {
    inside = inside || Canonical(photo.file.parent_path()) == folder_out;
    // images/ is read at any depth.
    inside = inside || (photo.path.starts_with("images/") &&
                        IsWithin(folder_out, Canonical(folder.root / "images")));
    if (inside) break;
  }
  if (!inside) return;
  throw InvalidArgument(
      "-o {} is where the photographs are: the results would be taken for photos the next time; "
      "name another folder",
      out.string());
}

}  // namespace color3d::client
