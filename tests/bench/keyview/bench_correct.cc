// color3d-bench correct: error of a coloured scene against the number of strokes that a user gives
// in its true colours, each where the scene is least sure then.
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/keyview/uncertain_place.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifacts.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"
#include "tests/bench/training_scores.h"

namespace color3d {
namespace {

struct Arguments {
  std::string scene_folder, run_folder, out_folder;
  int strokes = 3;
  double radius = 0.02;  // of the stroke, of the photo's longer side
  int threads = 2;
};

// A disc in the mean of the photo's true colours there, painted on nothing.
FurtherKeyView Stroke(const Arguments& args,
                      const Scene& scene,
                      int view,
                      double x,  // 0..1 of the picture
                      double y,
                      int number) {
  const std::filesystem::path folder = args.scene_folder;
  const Image photo = ReadImage(folder / scene.views[view].image_file);
  const double radius = args.radius * std::max(photo.width, photo.height);
  const double cx = x * photo.width, cy = y * photo.height;
  Image painted(photo.width, photo.height, 4);
  double sum[3] = {0.0, 0.0, 0.0};
  double count = 0.0;
  for (int row = 0; row < photo.height; ++row) {
    for (int column = 0; column < photo.width; ++column) {
      if (std::hypot(column + 0.5 - cx, row + 0.5 - cy) > radius) continue;
      for (int c = 0; c < 3; ++c) sum[c] += photo.At(c, row, column);
      painted.At(3, row, column) = 1.0f;
      ++count;
    }
  }
  for (int c = 0; c < 3; ++c) {
    std::fill_n(painted.Plane(c), painted.PlaneSize(), static_cast<float>(sum[c] / count));
  }
  FurtherKeyView correction{scene.views[view].name, {}};
  correction.color.source = ColorizeKeyViewOptions::Source::kStrokes;
  correction.color.file =
      std::filesystem::path(args.out_folder) / ("stroke" + std::to_string(number) + ".png");
  WriteFileAtomic(correction.color.file, EncodePng8(painted));
  return correction;
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
    const Stage* stage = StageThatLeaves(name);
    if (stage != nullptr && std::string_view(stage->kind) != kind::kSolveChroma) {
      pipeline.Take(name, std::filesystem::path(args.run_folder) / name);
    }
  }
  const Scene scene = SceneFromJson(ReadFile(pipeline.ArtifactPath(artifact::kScene)));
  CorrectColorsOptions options;
  for (int stroke = 0;; ++stroke) {
    nlohmann::ordered_json row = Score(&pipeline);
    row["strokes"] = stroke;
    UncertainPlace place;
    pipeline.Run("propose", [&](StageContext& c) {
      std::vector<Image> confidence(scene.views.size());
      for (const int view : scene.TrainingViews()) {
        confidence[view] = ReadViewConfidence(c, scene.views[view], 200, 150);
      }
      place = LeastCertainPlace(confidence);
    });
    if (stroke < args.strokes && place.view >= 0) {
      row["next"] = {scene.views[place.view].name, place.x / 200.0, place.y / 150.0};
      row["uncertainty"] = place.uncertainty;
    }
    std::printf("%s\n", row.dump().c_str());
    std::fflush(stdout);
    if (stroke == args.strokes || place.view < 0) return;
    options.corrections.push_back(
        Stroke(args, scene, place.view, place.x / 200.0, place.y / 150.0, stroke));
    pipeline.Run(kind::kCorrectColors, [&](StageContext& c) { RunCorrectColors(options, c); });
  }
}

}  // namespace

void AddCorrectCommand(CLI::App& app) {
  auto args = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "correct", "strokes in the true colours on a coloured scene: its training views' error");
  command->add_option("--scene", args->scene_folder, "folder of photos in colour")->required();
  command->add_option("--run", args->run_folder, "what `pipeline` has left")->required();
  command->add_option("--out", args->out_folder, "where artifacts go")->required();
  command->add_option("--strokes", args->strokes);
  command->add_option("--radius", args->radius, "of the strokes, of the photo's longer side");
  command->add_option("--threads", args->threads);
  command->callback([args] { Run(*args); });
}

}  // namespace color3d
