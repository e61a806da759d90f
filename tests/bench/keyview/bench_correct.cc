// color3d-bench correct: error of a coloured scene against the number of strokes in its true
// colours, each at the most uncertain place.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"
#include "tests/bench/training_scores.h"

namespace color3d {
namespace {

struct Arguments {
  std::string scene_folder, run_folder, out_folder;
  int strokes = 3;
  double radius = 0.03;  // radius of a stroke, relative to the photo's longer side
  bool true_colors = false;
  int threads = 2;
};

// Maximum colour difference within an object from its centre, Lab units.
constexpr float kOneThing = 15.0f;

// Paints a disc, restricted to the object in its centre, in the mean of the photo's true colours or
// in these colours.
ColorCorrection Stroke(const Arguments& args,
                       const Scene& scene,
                       int view,
                       int middle_x,  // px of the photo
                       int middle_y,
                       int number) {
  const std::filesystem::path folder = args.scene_folder;
  const Image photo = ReadImage(folder / scene.views[view].image_file);
  const Image lab = LabFromSrgb(photo);
  const double radius = args.radius * std::max(photo.width, photo.height);
  Image painted(photo.width, photo.height, 4);
  double sum[3] = {0.0, 0.0, 0.0};
  double count = 0.0;
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x) {
      if (std::hypot(x - middle_x, y - middle_y) > radius) continue;
      float difference = 0.0f;
      for (int c = 0; c < 3; ++c) {
        difference += std::abs(lab.At(c, y, x) - lab.At(c, middle_y, middle_x));
      }
      if (difference > kOneThing) continue;
      for (int c = 0; c < 3; ++c) {
        painted.At(c, y, x) = photo.At(c, y, x);
        sum[c] += photo.At(c, y, x);
      }
      painted.At(3, y, x) = 1.0f;
      ++count;
    }
  }
  for (int c = 0; c < 3 && !args.true_colors; ++c) {
    std::fill_n(painted.Plane(c), painted.PlaneSize(), static_cast<float>(sum[c] / count));
  }
  const std::filesystem::path file =
      std::filesystem::path(args.out_folder) / ("stroke" + std::to_string(number) + ".png");
  WriteFileAtomic(file, EncodePng8(painted));
  return {scene.views[view].name, {PaintedColors::Kind::kStrokes, file, {}}};
}

double SecondsOf(const LocalPipeline& pipeline, std::string_view kind) {
  double seconds = 0.0;
  for (const StageSummary& stage : pipeline.summaries()) {
    if (stage.kind == kind) seconds = stage.seconds;
  }
  return seconds;
}

nlohmann::ordered_json Score(LocalPipeline* pipeline) {
  nlohmann::ordered_json scores;
  pipeline->Run(kind::kSolveChroma, [](StageContext& c) { RunSolveChroma({}, c); });
  pipeline->Run("score_training", [&](StageContext& c) {
    const auto all = ScoreTrainingViews(c);
    for (const char* name : {"delta_e00_chroma", "delta_e00_chroma_2d", "share_seen"}) {
      scores[name] = all.at(name);
    }
  });
  return scores;
}

void Run(const Arguments& args) {
  LocalPipeline pipeline(args.scene_folder, args.out_folder, args.threads, 1, {});
  for (const std::string& name : ListFiles(args.run_folder)) {
    const Stage* stage = FindProducer(name);
    if (stage != nullptr && std::string_view(stage->kind) != kind::kSolveChroma) {
      pipeline.Take(name, std::filesystem::path(args.run_folder) / name);
    }
  }
  const Scene scene = SceneFromJson(ReadFile(pipeline.ArtifactPath(artifact::kScene)));
  CorrectColorsOptions options;
  options.proposals = 1;
  for (int stroke = 0;; ++stroke) {
    pipeline.Run(kind::kCorrectColors, [&](StageContext& c) { RunCorrectColors(options, c); });
    nlohmann::ordered_json row = Score(&pipeline);
    row["strokes"] = stroke;
    row["seconds"] = SecondsOf(pipeline, kind::kCorrectColors);
    const auto facts =
        nlohmann::ordered_json::parse(ReadFile(pipeline.ArtifactPath(artifact::kCorrections)));
    const auto& proposals = facts.at("proposals");
    if (!proposals.empty()) row["next"] = proposals.at(0);
    std::printf("%s\n", row.dump().c_str());
    std::fflush(stdout);
    if (stroke == args.strokes || proposals.empty()) return;
    options.corrections.push_back(
        Stroke(args,
               scene,
               scene.FindView(proposals.at(0).at("view").get<std::string>()),
               proposals.at(0).at("x"),
               proposals.at(0).at("y"),
               stroke));
  }
}

}  // namespace

void AddCorrectCommand(CLI::App& app) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "correct", "Measure the error of a coloured scene after strokes in its true colours");
  command
      ->add_option("--scene", args->scene_folder, "Folder of colour photos, with or without poses")
      ->required();
  command->add_option("--run", args->run_folder, "Output folder of a `pipeline` run")->required();
  command->add_option("--out", args->out_folder, "Folder for artifacts")->required();
  command->add_option("--strokes", args->strokes, "Number of strokes");
  command->add_option(
      "--radius", args->radius, "Radius of the strokes, relative to the photo's longer side");
  command->add_flag(
      "--true-colors", args->true_colors, "Paint the true colours instead of their mean");
  command->add_option("--threads", args->threads, "Number of threads");
  command->callback([args] { Run(*args); });
}

}  // namespace color3d
