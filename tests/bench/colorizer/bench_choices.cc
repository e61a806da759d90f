// color3d-bench choices: colour error of held-out views against seconds of personalization, with
// one choice of the colorizer varied at a time. Geometry, key view and carried colours of a scene
// are computed once; each point is a complete training. Time for scoring is excluded. Resumable:
// skips points that are already in the folder.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/carry/view_color.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/colorizer/scene_batch.h"
#include "core/metrics/view_scores.h"
#include "core/scene/view_images.h"
#include "core/stage/coloring/view_coloring.h"
#include "core/stage/formats/artifact_io.h"
#include "tests/bench/colorizer/bench_encoder.h"
#include "tests/bench/colorizer/choice_results.h"
#include "tests/bench/commands.h"
#include "tests/bench/local_pipeline.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;

constexpr char kPrepared[] = "prepared.json";

struct ChoicesArguments {
  std::string scene_folder;
  std::string out_folder;
  std::string geometry_file;
  std::vector<std::string> choices;
  std::vector<int> iterations = {0, 20, 60, 150};
  int max_side_px = 400;
  int threads = 2;
  uint64_t seed = 1;
  double stop_after_seconds = 1e9;
  bool carry = true;
  std::vector<std::string> table_folders;
};

// The default with one change.
struct Choice {
  std::string name = kDefaultChoice;
  std::string value;  // for display, without folders
  ColorizerOptions options;
  std::string encoder = "embedded";
  std::string pictures;  // kind of generated pictures, "all", or empty for none
  bool carry = true;
};

double Number(const std::string& name, const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0') {
    throw InvalidArgument("the choice {} is \"{}\"; give a number", name, text);
  }
  return value;
}

ColorizerOptions::Precision PrecisionOf(const std::string& name) {
  if (name == "float32") return ColorizerOptions::Precision::kFloat32;
  if (name == "bfloat16") return ColorizerOptions::Precision::kBfloat16;
  throw InvalidArgument("the precision \"{}\" is neither float32 nor bfloat16", name);
}

using Setter = std::function<void(const std::string& value, Choice* choice)>;
const std::map<std::string, Setter>& Setters() {
  const auto number = [](auto ColorizerOptions::*field) -> Setter {
    return [field](const std::string& value, Choice* c) {
      using Type = std::remove_reference_t<decltype(c->options.*field)>;
      c->options.*field = static_cast<Type>(Number(c->name, value));
    };
  };
  static const std::map<std::string, Setter> setters = {
      {"encoder",
       [](const std::string& value, Choice* c) {
         c->encoder = value;
         c->value = value.substr(0, value.find('='));
       }},
      {"adapter_stages", number(&ColorizerOptions::adapter_stages)},
      {"decoder_width", number(&ColorizerOptions::decoder_width)},
      {"crop", number(&ColorizerOptions::crop_px)},
      {"learning_rate", number(&ColorizerOptions::learning_rate)},
      {"consistency", number(&ColorizerOptions::consistency_weight)},
      {"average_decay", number(&ColorizerOptions::average_decay)},
      {"precision",
       [](const std::string& value, Choice* c) { c->options.precision = PrecisionOf(value); }},
      {"recipe",
       [](const std::string& value, Choice* c) {
         if (value != "paper")
           throw InvalidArgument("unknown recipe \"{}\"; give \"paper\", or no choice", value);
         c->options.UsePaperRecipe();
       }},
      {"pictures", [](const std::string& value, Choice* c) { c->pictures = value; }},
      {"geometry_first",
       [](const std::string& value, Choice* c) {
         if (value != "off")
           throw InvalidArgument("geometry_first is \"{}\"; give \"off\", or no choice", value);
         c->carry = false;
       }},
  };
  return setters;
}

// Parses "crop=128" or "default".
Choice ChoiceFrom(const std::string& text, const ChoicesArguments& args) {
  Choice choice;
  choice.options.max_side_px = args.max_side_px;
  choice.options.seed = args.seed;
  choice.carry = args.carry;
  if (text == kDefaultChoice) return choice;
  const size_t equals = text.find('=');
  choice.name = text.substr(0, equals);
  const auto setter = Setters().find(choice.name);
  if (equals == std::string::npos || setter == Setters().end()) {
    std::string known;
    for (const auto& [name, set] : Setters()) known += ", " + name + "=";
    throw InvalidArgument("unknown choice \"{}\"; choose from default{}", text, known);
  }
  choice.value = text.substr(equals + 1);
  setter->second(choice.value, &choice);
  return choice;
}

// Stages before personalization.
void Prepare(const ChoicesArguments& args, LocalPipeline& pipeline) {
  if (fs::exists(fs::path(args.out_folder) / kPrepared)) return pipeline.TakeAll();
  pipeline.ImportScene();
  const Scene scene = SceneFromJson(ReadFile(pipeline.ArtifactPath(artifact::kScene)));
  pipeline.SelectKeyView("");
  pipeline.Run("colorize_key_view", [&](StageContext& c) {
    ColorizeKeyViewOptions options;
    options.file = c.scene_folder() / scene.views[ReadKeyView(c, scene)].image_file;
    RunColorizeKeyView(options, c);
  });
  if (args.geometry_file.empty()) {
    pipeline.Run("reconstruct_geometry",
                 [&](StageContext& c) { RunReconstructGeometry({}, args.max_side_px, c); });
  } else {
    pipeline.Take(artifact::kGeometry, args.geometry_file);
  }
  pipeline.Run("generate_augmentations", [&](StageContext& c) {
    AugmentationOptions options;
    options.max_side_px = args.max_side_px;
    RunGenerateAugmentations(options, c);
  });
  pipeline.Run("carry_color", [&](StageContext& c) {
    CarryColorOptions options;
    options.max_side_px = args.max_side_px;
    RunCarryColor(options, c);
  });
  nlohmann::ordered_json seconds;
  for (const StageSummary& stage : pipeline.summaries()) seconds[stage.kind] = stage.seconds;
  WriteFileAtomic(fs::path(args.out_folder) / kPrepared, seconds.dump(1) + "\n");
}

class ChoiceBench {
 public:
  ChoiceBench(const ChoicesArguments& args, const LocalPipeline& pipeline)
      : args_(args),
        artifacts_(pipeline.artifacts()),
        scene_(SceneFromJson(ReadFile(artifacts_.at(artifact::kScene)))),
        images_(scene_, args.scene_folder, args.max_side_px),
        pool_(args.threads) {}

  ChoicePoint Measure(const Choice& choice, int iterations) {
    ColorizerOptions options = choice.options;
    options.iterations = iterations;
    ChoicePoint point{.scene = SceneName(),
                      .choice = choice.name,
                      .value = choice.value,
                      .iterations = iterations};
    Train(choice, options, &point);
    return point;
  }

  std::string SceneName() const {
    return fs::path(args_.scene_folder).lexically_normal().filename().string();
  }

 private:
  // Trains, and sets time and errors.
  void Train(const Choice& choice, const ColorizerOptions& options, ChoicePoint* point) {
    const ScratchFolder folder;
    SceneBatch batch(args_.threads);
    const auto encoder = batch.SharedEncoder(kEncoder, [&] { return EncoderOf(choice); });
    StageContext::Setup setup{args_.scene_folder,
                              InputsOf(choice, folder.path()),
                              folder.path(),
                              folder.path(),
                              args_.threads,
                              args_.seed};
    setup.batch = &batch;
    NoCheckpoints none;
    NullObserver silent;
    StageContext context(setup, none, silent, cancel_);
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t cpu_start = std::clock();
    RunPersonalize(options, context, kEncoder);
    point->seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC / args_.threads;
    point->wall_seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const auto colorizer =
        LoadColorizer(ReadFile(folder.path() / artifact::kColorizer), encoder, args_.threads);
    Score(*colorizer, context, point);
  }

  void Score(const Colorizer& colorizer, const StageContext& context, ChoicePoint* point) {
    for (int view = 0; view < static_cast<int>(scene_.views.size()); ++view) {
      if (!scene_.views[view].held_out) continue;
      const Image truth = images_.Srgb(view);
      const Image luminance = *images_.Luminance(view);
      const CarriedColor carried =
          ReadCarried(context, scene_.views[view], luminance.width, luminance.height);
      point->alone += ChromaError(truth, JoinLab(luminance, colorizer.Colorize(luminance)));
      const FusedColor fused =
          FuseViewColor(luminance, carried, SourcesOf(colorizer), pool_, cancel_);
      point->delivered += ChromaError(truth, JoinLab(luminance, fused.ab));
      ++point->views;
    }
    if (point->views == 0)
      throw InvalidArgument("the scene has no held-out view; give more photos");
    point->alone /= point->views;
    point->delivered /= point->views;
  }

  std::shared_ptr<const Encoder> EncoderOf(const Choice& choice) {
    auto& encoder = encoders_[choice.encoder];
    if (!encoder) encoder = BenchEncoder(choice.encoder);
    return encoder;
  }

  std::map<std::string, fs::path> InputsOf(const Choice& choice, const fs::path& folder) const {
    std::map<std::string, fs::path> inputs = artifacts_;
    inputs.erase(artifact::kAugmentationFacts);
    if (!choice.carry) {
      std::erase_if(inputs, [](const auto& i) { return i.first.starts_with(artifact::kCarried); });
    }
    if (choice.pictures.empty()) return inputs;
    auto facts = nlohmann::json::parse(ReadFile(artifacts_.at(artifact::kAugmentationFacts)));
    auto wanted = nlohmann::json::array();
    for (const auto& sample : facts.at("samples")) {
      if (choice.pictures == "all" || sample.at("kind") == choice.pictures) {
        wanted.push_back(sample);
      }
    }
    if (wanted.empty()) throw InvalidArgument("no pictures of kind {}", choice.pictures);
    facts["samples"] = wanted;
    const fs::path file = folder / artifact::kAugmentationFacts;
    WriteFileAtomic(file, facts.dump());
    inputs[artifact::kAugmentationFacts] = file;
    return inputs;
  }

  static constexpr char kEncoder[] = "bench";

  const ChoicesArguments& args_;
  std::map<std::string, fs::path> artifacts_;
  Scene scene_;
  ViewImages images_;
  ThreadPool pool_;
  CancellationToken cancel_;
  std::map<std::string, std::shared_ptr<const Encoder>> encoders_;
};

void MeasureAll(const ChoicesArguments& args) {
  const auto start = std::chrono::steady_clock::now();
  LocalPipeline pipeline(
      args.scene_folder, args.out_folder, args.threads, args.seed, [](const std::string& text) {
        std::fprintf(stderr, "%s\n", text.c_str());
      });
  Prepare(args, pipeline);
  ChoiceBench bench(args, pipeline);
  const fs::path file = fs::path(args.out_folder) / kChoicePoints;
  const std::vector<ChoicePoint> finished = ReadChoicePoints(file);
  for (const std::string& text : args.choices) {
    const Choice choice = ChoiceFrom(text, args);
    for (const int iterations : args.iterations) {
      const ChoicePoint work{.scene = bench.SceneName(),
                             .choice = choice.name,
                             .value = choice.value,
                             .iterations = iterations};
      if (std::any_of(
              finished.begin(), finished.end(), [&](const auto& p) { return p.SameWork(work); })) {
        continue;
      }
      if (std::chrono::steady_clock::now() - start >
          std::chrono::duration<double>(args.stop_after_seconds)) {
        throw Error(ErrorCode::kAborted, "out of time; repeat the command to continue");
      }
      const ChoicePoint point = bench.Measure(choice, iterations);
      AppendChoicePoint(file, point);
      std::fprintf(stderr,
                   "%s, %s, %d iterations: %.1f s (wall %.1f s), %.3f alone, %.3f delivered\n",
                   point.scene.c_str(),
                   text.c_str(),
                   iterations,
                   point.seconds,
                   point.wall_seconds,
                   point.alone,
                   point.delivered);
    }
  }
}

void RunChoices(const ChoicesArguments& args) {
  if (args.table_folders.empty()) return MeasureAll(args);
  std::printf("%s", ChoiceTables(ReadChoiceFolders(args.table_folders)).c_str());
}

}  // namespace

void AddChoicesCommand(CLI::App& app) {
  auto args = std::make_shared<ChoicesArguments>();
  CLI::App* command = app.add_subcommand(
      "choices", "Measure error against seconds for each choice of the colorizer");
  auto* scene = command->add_option(
      "--scene", args->scene_folder, "Folder of colour photos, with or without poses");
  auto* out = command->add_option(
      "--out", args->out_folder, "Folder for choices.jsonl, one line per point");
  scene->needs(out);
  command
      ->add_option("--geometry",
                   args->geometry_file,
                   "geometry.c3g of an earlier run of the scene, instead of training")
      ->check(CLI::ExistingFile);
  command->add_option(
      "--choice",
      args->choices,
      "Choice to measure: default, encoder=random, encoder=squeezenet=FILE, adapter_stages=, "
      "decoder_width=, crop=, precision=, learning_rate=, average_decay=, consistency=, "
      "recipe=paper, pictures=KIND or geometry_first=off. May be repeated");
  command->add_option("--iterations", args->iterations, "Iterations of each choice, ascending")
      ->delimiter(',')
      ->capture_default_str();
  command->add_option("--max-side", args->max_side_px, "Longer side of the working pictures, px");
  command->add_option("--threads", args->threads, "Number of threads");
  command->add_option("--seed", args->seed, "Seed");
  command->add_option(
      "--stop-after", args->stop_after_seconds, "Start no point after these seconds");
  command->add_flag("--carry,!--no-carry",
                    args->carry,
                    "Carry colours (default), or not, as in a scene where nothing can be carried "
                    "(use another --out)");
  command->add_option("--table", args->table_folders, "Output folders: only print their tables")
      ->excludes(scene);
  command->callback([args] {
    if (args->scene_folder.empty() == args->table_folders.empty()) {
      throw CLI::RequiredError("--scene and --out, or --table");
    }
    RunChoices(*args);
  });
}

}  // namespace color3d
