// color3d-bench recolor: error of recolouring (STILL.md "Recolouring") on colour photos. The edit
// turns the hue of all colours in a range of hues, so that the truth of every view is known: the
// same edit of its own photo. The key view alone is edited; errors are of the other views.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/key_photo.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"

namespace color3d {
namespace {

struct Arguments {
  std::string scene_folder, run_folder, out_folder;
  double hue_deg = 85.0;
  double reach_deg = 25.0;
  double turn_deg = 180.0;
  double min_chroma = 25.0;
  int side_px = 500;
  int threads = 2;
  bool carry = true;
};

constexpr double kEdgeDeg = 8.0, kEdgeChroma = 8.0;  // the edit fades in over these

// Edited share of a colour, 0..1.
double ShareOf(const Arguments& args, double a, double b) {
  const double hue = std::atan2(b, a) * 180.0 / std::numbers::pi;
  const double off = std::abs(std::remainder(hue - args.hue_deg, 360.0));
  return std::clamp((args.reach_deg - off) / kEdgeDeg, 0.0, 1.0) *
         std::clamp((std::hypot(a, b) - args.min_chroma) / kEdgeChroma, 0.0, 1.0);
}

// The edit of a Lab picture; `share` (may be null) receives its share of each pixel.
Image Edited(const Arguments& args, const Image& lab, Image* share) {
  Image out = lab;
  if (share != nullptr) *share = Image(lab.width, lab.height, 1);
  for (size_t i = 0; i < lab.PlaneSize(); ++i) {
    const double a = lab.Plane(1)[i], b = lab.Plane(2)[i];
    const double s = ShareOf(args, a, b);
    const double turn = args.turn_deg * std::numbers::pi / 180.0;
    const double turned_a = std::cos(turn) * a - std::sin(turn) * b;
    const double turned_b = std::sin(turn) * a + std::cos(turn) * b;
    out.Plane(1)[i] = static_cast<float>(a + s * (turned_a - a));
    out.Plane(2)[i] = static_cast<float>(b + s * (turned_b - b));
    if (share != nullptr) share->data[i] = static_cast<float>(s);
  }
  // What 8 bits of sRGB can hold.
  return LabFromSrgb(SrgbFromLab(out));
}

struct Sum {
  double sum = 0.0, count = 0.0;
  std::vector<double> all;
  void Add(double error) { sum += error, ++count, all.push_back(error); }
  nlohmann::ordered_json Facts() {
    if (all.empty()) return nullptr;
    std::ranges::sort(all);
    return {{"mean", sum / count}, {"p90", all[all.size() * 9 / 10]}, {"pixels", all.size()}};
  }
};

Image ReadAb(const std::filesystem::path& file, int width, int height) {
  return Resize(DecodeAbPng(ReadFile(file), file.string()).ab, width, height);
}

struct Scores {
  Sum inside, outside, inside_unedited;  // the last: of the photos as they are
};

void Score(const Image& truth, const Image& share, const Image& own, const Image& ab, Scores* to) {
  for (size_t i = 0; i < truth.PlaneSize(); ++i) {
    const double l = truth.Plane(0)[i];
    const LabColor is{l, ab.Plane(0)[i], ab.Plane(1)[i]};
    const LabColor wanted{l, truth.Plane(1)[i], truth.Plane(2)[i]};
    if (share.data[i] == 0.0f) to->outside.Add(DeltaE00(is, wanted));
    if (share.data[i] <= 0.5f) continue;
    to->inside.Add(DeltaE00(is, wanted));
    to->inside_unedited.Add(DeltaE00({l, own.Plane(1)[i], own.Plane(2)[i]}, wanted));
  }
}

// Photo, truth and result of a view, one below the other.
Image Sheet(const Image& own, const Image& truth, const Image& ab) {
  Image lab = own;
  std::copy_n(ab.data.begin(), ab.data.size(), lab.Plane(1));
  Image sheet(own.width, 3 * own.height, 3);
  int row = 0;
  for (const Image& srgb : {SrgbFromLab(own), SrgbFromLab(truth), SrgbFromLab(lab)}) {
    for (int c = 0; c < 3; ++c) {
      std::copy_n(srgb.Plane(c), srgb.PlaneSize(), &sheet.At(c, row * own.height, 0));
    }
    ++row;
  }
  return sheet;
}

// Colours the scene from the edited key photo. With `keep` as an edit, else as a coloured picture,
// whose colours all views take.
void Colorize(const Arguments& args, const Image& edited, bool keep, LocalPipeline* pipeline) {
  const std::filesystem::path file = std::filesystem::path(args.out_folder) / "edited.png";
  WriteFileAtomic(file, EncodePng16(SrgbFromLab(edited)));
  pipeline->Run(kind::kColorizeKeyView, [&](StageContext& c) {
    ColorizeKeyViewOptions options;
    using Source = ColorizeKeyViewOptions::Source;
    options.source = keep ? Source::kEdit : Source::kImage;
    options.file = file;
    RunColorizeKeyView(options, c);
  });
  if (args.carry) {
    pipeline->Run(kind::kCarryColor, [&](StageContext& c) {
      CarryColorOptions options;
      options.max_side_px = args.side_px;
      RunCarryColor(options, c);
    });
  }
  pipeline->Run(kind::kPersonalize, [](StageContext& c) { RunPersonalize({}, c); });
  pipeline->Run(kind::kColorizeViews,
                [&](StageContext& c) { RunColorizeViews({.max_side_px = args.side_px}, c); });
}

void Run(const Arguments& args) {
  std::filesystem::create_directories(args.out_folder);
  nlohmann::ordered_json result;
  for (const bool keep : {true, false}) {
    const std::filesystem::path out =
        std::filesystem::path(args.out_folder) / (keep ? "edit" : "picture");
    LocalPipeline pipeline(args.scene_folder, out, args.threads, 1, {});
    for (const char* name :
         {artifact::kScene, artifact::kImportFacts, artifact::kKeyView, artifact::kGeometry}) {
      pipeline.Take(name, std::filesystem::path(args.run_folder) / name);
    }
    const Scene scene = SceneFromJson(ReadFile(pipeline.ArtifactPath(artifact::kScene)));
    const auto key_view =
        nlohmann::json::parse(ReadFile(pipeline.ArtifactPath(artifact::kKeyView)));
    const int key = scene.FindView(key_view.at("view").get<std::string>());
    const std::filesystem::path folder = args.scene_folder;
    const Image photo = ReadKeyPhoto(folder / scene.views[key].image_file, int64_t{1} << 32);
    Colorize(args, Edited(args, LabFromSrgb(photo), nullptr), keep, &pipeline);
    const ViewImages images(scene, folder, args.side_px);
    Scores scores;
    for (int view = 0; view < std::ssize(scene.views); ++view) {
      if (view == key) continue;
      const Image own = LabFromSrgb(images.Srgb(view));
      const std::string name = ViewArtifact(artifact::kViewsAb, scene.views[view]);
      const Image ab = ReadAb(pipeline.ArtifactPath(name), own.width, own.height);
      Image share;
      const Image truth = Edited(args, own, &share);
      Score(truth, share, own, ab, &scores);
      const std::filesystem::path sheet = out / ViewArtifact("sheets/", scene.views[view], ".jpg");
      std::filesystem::create_directories(sheet.parent_path());
      WriteFileAtomic(sheet, EncodeJpeg(Sheet(own, truth, ab)));
    }
    double seconds = 0.0;
    for (const StageSummary& stage : pipeline.summaries()) seconds += stage.seconds;
    result[keep ? "as_edit" : "as_picture"] = {{"outside", scores.outside.Facts()},
                                               {"inside", scores.inside.Facts()},
                                               {"inside_unedited", scores.inside_unedited.Facts()},
                                               {"seconds", seconds}};
  }
  std::printf("%s\n", result.dump(1).c_str());
}

}  // namespace

void AddRecolorCommand(CLI::App& app) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "recolor", "Measure the error of recolouring a scene of colour photos from its key view");
  command->add_option("--scene", args->scene_folder, "Folder of colour photos")->required();
  command->add_option("--run", args->run_folder, "Output folder of a `pipeline` run")->required();
  command->add_option("--out", args->out_folder, "Folder for artifacts and pictures")->required();
  command->add_option("--hue", args->hue_deg, "Hue of the edited colours in Lab, degrees");
  command->add_option("--reach", args->reach_deg, "Largest distance to that hue, degrees");
  command->add_option("--turn", args->turn_deg, "Angle by which the edit turns hues, degrees");
  command->add_option("--min-chroma", args->min_chroma, "Smallest edited chroma, Lab units");
  command->add_option("--side", args->side_px, "Longer side of the working pictures, px");
  command->add_option("--threads", args->threads, "Number of threads");
  command->add_flag("--carry,!--no-carry",
                    args->carry,
                    "Carry the edit through the geometry (default), or infer it only");
  command->callback([args] { Run(*args); });
}

}  // namespace color3d
