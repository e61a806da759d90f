// color3d-bench film: error against the true colours, and steadiness, of a film in grey, with each
// frame coloured automatically, by optical flow alone, and by the personalized colorizer after
// several lengths of training.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/base/evenly.h"
#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/metrics/scene_consistency.h"
#include "core/metrics/temporal_consistency.h"
#include "core/metrics/view_scores.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct FilmArguments {
  std::string frames_folder;
  std::string out_folder;
  std::string key_view;
  std::string recolor_view;  // in its true colours; the key view then has false ones
  std::vector<double> recolor_s = {0.0, 1e6};  // begin and end of the range, s
  std::vector<int> iterations = {0, 20, 50, 100, 200};
  int max_side_px = 500;
  int threads = 2;
  uint64_t seed = 1;
};

ordered_json JsonOf(const TemporalConsistency& figures) {
  return {{"tc_chroma", figures.tc_chroma}, {"chroma", figures.chroma}, {"cdc", figures.cdc}};
}

class FilmBench {
 public:
  FilmBench(const FilmArguments& args, const fs::path& scene_folder)
      : args_(args),
        pipeline_(scene_folder, args.out_folder, args.threads, args.seed, [](const std::string& s) {
          std::fprintf(stderr, "%s\n", s.c_str());
        }) {}

  ordered_json Run() {
    pipeline_.ImportScene();
    pipeline_.Run(kind::kSelectKeyView, [&](StageContext& context) {
      SelectKeyViewOptions options;
      options.view = args_.key_view;
      if (!args_.key_view.empty()) options.selection.strategy = KeyViewStrategy::kManual;
      RunSelectKeyView(options, context);
    });
    pipeline_.Run(kind::kColorizeKeyView, [&](StageContext& context) {
      const Scene scene = ReadScene(context);
      ColorizeKeyViewOptions options;
      options.file = context.scene_folder() / scene.views[ReadKeyView(context, scene)].image_file;
      if (!args_.recolor_view.empty()) options.file = InFalseColors(options.file, context);
      RunColorizeKeyView(options, context);
    });
    pipeline_.Run(kind::kCarryColor, [&](StageContext& context) {
      CarryColorOptions options;
      options.max_side_px = args_.max_side_px;
      RunCarryColor(options, context);
    });
    const double carried_after = Seconds();
    ordered_json rows = ordered_json::array();
    pipeline_.Run("baselines", [&](StageContext& context) { rows = Baselines(context); });
    for (ordered_json& row : rows) {
      if (row.at("colors") == "carried alone") row["seconds"] = carried_after;
    }
    for (const int iterations : args_.iterations) rows.push_back(Personalized(iterations));
    if (!args_.recolor_view.empty()) rows.push_back(Recolored());
    return rows;
  }

 private:
  double Seconds() const {
    double seconds = 0.0;
    for (const StageSummary& stage : pipeline_.summaries()) seconds += stage.seconds;
    return seconds;
  }

  // Mean chroma error of held-out frames.
  static double ErrorOf(const Scene& scene,
                        const ViewImages& images,
                        const std::function<Image(int view)>& lab) {
    double error = 0.0;
    for (const int view : scene.HeldOutViews()) error += ChromaError(images.Srgb(view), lab(view));
    return error / static_cast<double>(scene.HeldOutViews().size());
  }

  ordered_json Baselines(StageContext& context) const {
    const Scene scene = ReadScene(context);
    const ViewImages images(scene, context.scene_folder(), kConsistencySidePx, 0);
    const auto colorizer = AutomaticColorizer::Embedded();
    std::vector<Image> automatic(scene.views.size());
    context.pool().ForEach(static_cast<int64_t>(automatic.size()), [&](int64_t i, int) {
      automatic[i] = colorizer->Colorize(*images.Luminance(static_cast<int>(i))).ab;
    });
    const auto gray = [&](int view) {
      const auto luminance = images.Luminance(view);
      return JoinLab(*luminance, Image(luminance->width, luminance->height, 2));
    };
    // Pixels without flow stay grey.
    const auto carried = [&](int view) {
      const auto luminance = images.Luminance(view);
      return JoinLab(
          *luminance,
          ReadCarried(context, scene.views[view], luminance->width, luminance->height).ab);
    };
    const auto guessed = [&](int view) {
      return JoinLab(*images.Luminance(view), automatic[view]);
    };
    const auto truth = [&](int view) { return LabFromSrgb(images.Srgb(view)); };
    TemporalSource source;
    source.shots.resize(1);
    source.shots[0].resize(scene.views.size());
    std::iota(source.shots[0].begin(), source.shots[0].end(), 0);
    source.luminance = [&](int view) { return *images.Luminance(view); };
    const std::pair<const char*, std::function<Image(int)>> colorings[] = {
        {"none", gray},
        {"each frame by the automatic colourizer", guessed},
        {"carried alone", carried},
        {"true", truth}};
    for (const auto& [name, lab] : colorings) source.colorings.push_back(lab);
    const auto figures = MeasureTemporalConsistency(source, context.pool(), context.cancel());
    ordered_json rows = ordered_json::array();
    for (size_t i = 0; i < figures.size(); ++i) {
      ordered_json row{{"colors", colorings[i].first},
                       {"delta_e00_chroma", ErrorOf(scene, images, colorings[i].second)}};
      row.update(JsonOf(figures[i]));
      rows.push_back(std::move(row));
    }
    return rows;
  }

  // Errors of some frames that are not held out, to choose constants by.
  static double TrainingError(const StageContext& context) {
    constexpr size_t kFrames = 8;
    const Scene scene = ReadScene(context);
    const ViewImages images(scene, context.scene_folder(), kConsistencySidePx, 0);
    const std::vector<int> views = PickEvenly(scene.TrainingViews(), kFrames);
    double error = 0.0;
    for (const int view : views) {
      const auto luminance = images.Luminance(view);
      const Image ab = ReadViewAb(context, scene.views[view], luminance->width, luminance->height);
      error += ChromaError(images.Srgb(view), JoinLab(*luminance, ab));
    }
    return error / static_cast<double>(views.size());
  }

  ordered_json Personalized(int iterations) {
    const double before = Seconds();
    pipeline_.Run(kind::kPersonalize, [&](StageContext& context) {
      ColorizerOptions options;
      options.iterations = iterations;
      options.seed = args_.seed;
      options.max_side_px = args_.max_side_px;
      RunPersonalize(options, context);
    });
    const double trained = Seconds();
    pipeline_.Run(kind::kColorizeViews, [&](StageContext& context) {
      RunColorizeViews({.max_side_px = args_.max_side_px}, context);
    });
    const double colored = Seconds();
    pipeline_.Run(kind::kEvaluate, [&](StageContext& context) {
      const Scene scene = ReadScene(context);
      EvaluateOptions options;
      for (const int view : scene.HeldOutViews()) {
        options.truth.push_back(
            {scene.views[view].name, context.scene_folder() / scene.views[view].image_file});
      }
      RunEvaluate(options, context);
    });
    double training_error = 0.0;
    pipeline_.Run("training scores",
                  [&](StageContext& context) { training_error = TrainingError(context); });
    const auto scores = ordered_json::parse(ReadFile(pipeline_.ArtifactPath(artifact::kScores)));
    const ordered_json& temporal = scores.at("temporal").at("colored_views");
    return {{"colors", "personalized"},
            {"iterations", iterations},
            {"training_delta_e00_chroma", training_error},
            {"delta_e00_chroma", scores.at("mean").at("delta_e00_chroma")},
            {"tc_chroma", temporal.at("tc_chroma")},
            {"chroma", temporal.at("chroma")},
            {"cdc", temporal.at("cdc")},
            {"seconds_personalize", trained - before},
            {"seconds_colorize_views", colored - trained}};
  }

  // Swaps a and b.
  static fs::path InFalseColors(const fs::path& picture, const StageContext& context) {
    Image lab = LabFromSrgb(ReadImage(picture));
    std::swap_ranges(lab.Plane(1), lab.Plane(2), lab.Plane(2));
    const fs::path file = context.scratch_folder() / "false_colors.png";
    WriteFileAtomic(file, EncodePng16(SrgbFromLab(lab)));
    return file;
  }

  // Mean chroma errors of the held-out frames within the range, before and after recolouring.
  ordered_json Recolored() {
    const double before = Seconds();
    const auto errors = [&] {
      double inside = 0.0;
      int count = 0;
      pipeline_.Run("scores of a range", [&](StageContext& context) {
        const Scene scene = ReadScene(context);
        const ViewImages images(scene, context.scene_folder(), kConsistencySidePx, 0);
        for (const int view : scene.HeldOutViews()) {
          const double time_s = scene.views[view].time_s();
          if (time_s < args_.recolor_s[0] || time_s > args_.recolor_s[1]) continue;
          const auto l = images.Luminance(view);
          inside +=
              ChromaError(images.Srgb(view),
                          JoinLab(*l, ReadViewAb(context, scene.views[view], l->width, l->height)));
          ++count;
        }
      });
      return inside / std::max(count, 1);
    };
    const double was = errors();
    pipeline_.Run(
        kind::kColorizeKeyView,
        [&](StageContext& context) {
          const Scene scene = ReadScene(context);
          const View& view = scene.views[scene.FindView(args_.recolor_view)];
          RunColorizeKeyView({.file = context.scene_folder() / view.image_file, .view = view.name},
                             context);
        },
        std::string(artifact::kKeyViews) + "1/");
    pipeline_.Run(kind::kCorrectColors, [&](StageContext& context) {
      const RangeKeyView key{args_.recolor_view, args_.recolor_s[0], args_.recolor_s[1]};
      RunCorrectColors({.ranges = {key}, .proposals = 0}, context);
    });
    const double seconds = Seconds() - before;
    return {{"colors", "recolored"},
            {"delta_e00_chroma_before", was},
            {"delta_e00_chroma", errors()},
            {"seconds", seconds}};
  }

  const FilmArguments& args_;
  LocalPipeline pipeline_;
};

void RunFilm(const FilmArguments& args) {
  const ScratchFolder scratch;
  const fs::path frames = scratch.path() / "frames";
  fs::create_directories(frames);
  for (const std::string& file : ListFiles(args.frames_folder)) {
    const fs::path link = frames / file;
    fs::create_directories(link.parent_path());
    fs::create_symlink(fs::absolute(fs::path(args.frames_folder) / file), link);
  }
  std::printf("%s\n", FilmBench(args, scratch.path()).Run().dump(1).c_str());
}

}  // namespace

void AddFilmCommand(CLI::App& app) {
  auto args = std::make_shared<FilmArguments>();
  CLI::App* command =
      app.add_subcommand("film",
                         "Measure error and steadiness of a film coloured automatically, by "
                         "optical flow, and by the personalized colorizer");
  command->add_option("--frames", args->frames_folder, "Folder of colour frames, ordered by name")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option("--out", args->out_folder, "Folder for artifacts")->required();
  command->add_option(
      "--key-view", args->key_view, "Name of the key frame, given in its true colours");
  command->add_option("--recolor-view",
                      args->recolor_view,
                      "Name of the frame that recolours a range of time in its true colours; the "
                      "key frame then has false ones");
  command->add_option("--recolor-range", args->recolor_s, "Begin and end of that range, s")
      ->expected(2);
  command
      ->add_option(
          "--iterations", args->iterations, "Iterations of personalization; may be repeated")
      ->check(CLI::Range(0, 100000));
  command->add_option("--max-side", args->max_side_px, "Longer side of the working pictures, px")
      ->check(CLI::Range(64, 4096));
  command->add_option("--threads", args->threads, "Number of threads")->check(CLI::Range(1, 256));
  command->add_option("--seed", args->seed, "Seed");
  command->callback([args] { RunFilm(*args); });
}

}  // namespace color3d
