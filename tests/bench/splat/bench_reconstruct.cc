// color3d-bench reconstruct: trains geometry on true colours or luminance. Measures quality of
// held-out views against seconds of training, and seconds by part.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/carry/dense_points.h"
#include "core/catalogue/iteration_cap.h"
#include "core/image/codec.h"
#include "core/metrics/quality.h"
#include "core/report/curves.h"
#include "core/scene/import/import.h"
#include "core/scene/masks/still_regions.h"
#include "core/simd/instruction_set.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/model/gaussian_cap.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "server/planning/presets.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"

namespace color3d {
namespace {

struct ReconstructArguments {
  std::string scene_folder;
  std::string json_file;
  std::string pictures_folder;
  std::vector<std::string> settings;  // name=value of GeometryTuning
  std::string preset = "none";
  int max_side_px = 500;
  int threads = 2;
  TrainingColors colors = TrainingColors::kSrgb;
  std::string imported_file;  // scene.json of an earlier import
  std::string geometry_file;  // output
  std::string moving_folder;  // moving regions of each view, as written by import
  int score_side_px = 500;    // beside the size of training
  std::string set_aside;      // "K/N"
  bool capped = false;        // as in the service
  double dense = 0.0;         // share of the initial Gaussians
  DensePointsOptions dense_points;
  GeometryOptions geometry{.iterations = 3000, .max_gaussians = 150'000};
};

// The geometry values of a preset of the service.
void UsePreset(const std::string& name, ReconstructArguments& args) {
  const v1::ColorizeSceneSpec& options = OptionsOf(name == "best"    ? v1::PRESET_BEST
                                                   : name == "paper" ? v1::PRESET_PAPER
                                                                     : v1::PRESET_FAST);
  args.preset = name;
  args.max_side_px = options.max_side_px();
  const v1::ReconstructGeometrySpec& geometry = options.reconstruct_geometry();
  args.geometry.iterations = geometry.iterations();
  args.geometry.max_gaussians = geometry.max_gaussians();
  args.geometry.sh_degree = geometry.sh_degree();
  args.geometry.densify_gradient = geometry.densify_gradient();
  if (geometry.recipe() == v1::ReconstructGeometrySpec::RECIPE_PAPER) {
    args.geometry.recipe = GeometryOptions::Recipe::kPaper;
  }
  if (geometry.deformation() == v1::ReconstructGeometrySpec::DEFORMATION_HEXPLANE) {
    args.geometry.deformation = GeometryOptions::Deformation::kHexPlane;
  }
}

// Sets "name=value" of a schedule other than the default.
void Apply(const std::string& setting, GeometryTuning& tuning) {
  const size_t equals = setting.find('=');
  const std::string name = setting.substr(0, equals);
  char* end = nullptr;
  const double value =
      equals == std::string::npos ? 0.0 : std::strtod(setting.c_str() + equals + 1, &end);
  bool applied = false;
  if (end != nullptr && *end == '\0' && end != setting.c_str() + equals + 1) {
    VisitFields(tuning, [&](const char* field, auto& number) {
      if (name != field) return;
      number = static_cast<std::decay_t<decltype(number)>>(value);
      applied = true;
    });
  }
  if (!applied) {
    throw InvalidArgument("--set {}: give name=value with a field of GeometryTuning", setting);
  }
}

GeometryOptions OptionsFrom(const ReconstructArguments& args) {
  GeometryOptions options = args.geometry;
  if (args.settings.empty()) return options;
  options.tuning = TuningOf(options);
  for (const std::string& setting : args.settings) Apply(setting, *options.tuning);
  return options;
}

// The truth on the left, the render on the right.
Image SideBySide(const Image& left, const Image& right) {
  Image both(left.width + right.width, left.height, left.channels);
  for (int c = 0; c < both.channels; ++c) {
    for (int y = 0; y < both.height; ++y) {
      for (int x = 0; x < both.width; ++x) {
        both.At(c, y, x) = x < left.width ? left.At(c, y, x) : right.At(c, y, x - left.width);
      }
    }
  }
  return both;
}

// 3 channels of sRGB, or L' in 0..1 as grey.
Image Truth(const ViewImages& images, int view, TrainingColors colors) {
  if (colors == TrainingColors::kSrgb) return images.Srgb(view);
  Image luminance = *images.Luminance(view);
  for (float& v : luminance.data) v *= 0.01f;
  return luminance;
}

nlohmann::ordered_json ToJson(const ReconstructArguments& args, const TrainingTrace& trace) {
  const double n = static_cast<double>(std::max<int64_t>(1, trace.iterations));
  nlohmann::ordered_json result{
      {"scene", args.scene_folder},
      {"preset", args.preset},
      {"max_side_px", args.max_side_px},
      {"colours", args.colors == TrainingColors::kSrgb ? "truth" : "luminance"},
      {"threads", args.threads},
      {"instruction_set", std::string(ActiveInstructionSet())},
      {"seconds", trace.seconds},
      {"iterations", trace.iterations},
      {"gaussians", trace.gaussians},
      {"ms_per_iteration", 1000.0 * trace.seconds / n}};
  for (int p = 0; p < kPhaseCount; ++p) {
    if (static_cast<Phase>(p) == Phase::kEvaluation) continue;
    result["ms_per_iteration_by_phase"][kPhaseNames[p]] = 1000.0 * trace.phases[p] / n;
  }
  result["training"] = {{"psnr_db", trace.training.psnr_db},
                        {"ssim", trace.training.ssim},
                        {"l1", trace.training.l1}};
  for (const HeldOutPoint& p : trace.held_out) {
    result["held_out"].push_back({{"seconds", p.seconds},
                                  {"iteration", p.iteration},
                                  {"gaussians", p.gaussians},
                                  {"psnr_db", p.psnr_db},
                                  {"ssim", p.ssim},
                                  {"l1", p.l1}});
  }
  return result;
}

Scene SceneOf(const ReconstructArguments& args, const RunControl& run) {
  if (!args.imported_file.empty()) return SceneFromJson(ReadFile(args.imported_file));
  const ScratchFolder scratch;
  ImportOptions import_options;
  import_options.hold_out_every_eighth = true;
  return ImportScene(args.scene_folder, scratch.path(), import_options, run).scene;
}

// "K/N": holds out every N-th training view from the K-th on, in place of the scene's own held-out
// views, which are then unused. For the choice of constants.
void SetAside(const std::string& fold, Scene& scene) {
  int k = 0, n = 0;
  if (std::sscanf(fold.c_str(), "%d/%d", &k, &n) != 2 || k < 0 || k >= n) {
    throw InvalidArgument("--hold-out-training {}: give K/N with K from 0 to N - 1", fold);
  }
  Scene kept = scene;
  kept.views.clear();
  std::vector<int> renumbered(scene.views.size(), -1);
  int number = 0;
  for (size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].held_out) continue;
    renumbered[v] = static_cast<int>(kept.views.size());
    kept.views.push_back(scene.views[v]);
    kept.views.back().held_out = number++ % n == k;
  }
  for (SparsePoint& point : kept.points) {
    std::vector<int> views;
    for (const int v : point.views) {
      if (renumbered[v] >= 0) views.push_back(renumbered[v]);
    }
    point.views = views;
  }
  scene = std::move(kept);
}

std::vector<Camera> TrainingCameras(const Scene& scene) {
  std::vector<Camera> cameras;
  for (const int view : scene.TrainingViews()) cameras.push_back(scene.views[view].camera);
  return cameras;
}

// Mean over renders at the size of training, after render and truth were reduced to `side_px`, so
// that presets of different sizes are comparable.
class ReducedScore {
 public:
  explicit ReducedScore(int side_px) : side_px_(side_px) {}

  void Add(const Image& truth, const Image& drawn) {
    const double scale =
        std::min(1.0, side_px_ / static_cast<double>(std::max(truth.width, truth.height)));
    const int width = static_cast<int>(std::lround(scale * truth.width));
    const int height = static_cast<int>(std::lround(scale * truth.height));
    sum_psnr_ += Psnr(Resize(truth, width, height), Resize(drawn, width, height), 1.0);
    sum_ssim_ += Ssim(Resize(truth, width, height), Resize(drawn, width, height), 1.0);
    ++views_;
  }
  nlohmann::ordered_json ToJson() const {
    return {{"side_px", side_px_}, {"psnr_db", sum_psnr_ / views_}, {"ssim", sum_ssim_ / views_}};
  }

 private:
  int side_px_;
  int views_ = 0;
  double sum_psnr_ = 0.0;
  double sum_ssim_ = 0.0;
};

// Background of each view according to import; empty without a folder.
PictureSource StillRegionsOf(const std::string& folder,
                             const Scene& scene,
                             const ViewImages& images) {
  if (folder.empty()) return {};
  return [&, folder = std::filesystem::path(folder)](int view) -> std::shared_ptr<const Image> {
    const auto file = folder / ViewArtifact("", scene.views[view], ".png");
    if (!std::filesystem::exists(file)) return nullptr;
    return std::make_shared<const Image>(StillRegion(images, scene, view, ReadImage(file)));
  };
}

// PSNR of foreground and background over all pictures, dB.
class ScoreByMotion {
 public:
  void Add(const Image& truth, const Image& drawn, const Image& still) {
    for (int c = 0; c < truth.channels; ++c) {
      for (size_t i = 0; i < still.data.size(); ++i) {
        const double d = double{truth.Plane(c)[i]} - drawn.Plane(c)[i];
        const int part = still.data[i] > 0.0f ? 1 : 0;
        squares_[part] += d * d;
        values_[part] += 1.0;
      }
    }
  }
  nlohmann::ordered_json ToJson() const {
    const auto db = [&](int part) {
      return -10.0 * std::log10(squares_[part] / std::max(1.0, values_[part]));
    };
    return {{"moving_db", db(0)},
            {"still_db", db(1)},
            {"moving_share", values_[0] / std::max(1.0, values_[0] + values_[1])}};
  }

 private:
  double squares_[2] = {};
  double values_[2] = {};
};

void RunReconstruct(ReconstructArguments args) {
  NullObserver silent;
  NoCheckpoints none;
  CancellationToken cancel;
  ThreadPool pool(args.threads);
  Scene scene = SceneOf(args, {pool, none, silent, cancel});
  if (!args.set_aside.empty()) SetAside(args.set_aside, scene);
  if (args.capped) {
    args.geometry.max_gaussians =
        GaussianCap(args.geometry.max_gaussians, TrainingCameras(scene), args.max_side_px);
    args.geometry.iterations =
        IterationCap(args.geometry.iterations, static_cast<int>(scene.TrainingViews().size()));
  }
  const ViewImages images(scene, args.scene_folder, args.max_side_px);
  for (const int view : scene.TrainingViews()) images.Luminance(view);  // not in the times
  const PictureSource still = StillRegionsOf(args.moving_folder, scene, images);
  const auto begin = std::chrono::steady_clock::now();
  if (args.dense > 0.0) {
    args.dense_points.max_points = static_cast<int>(args.dense * args.geometry.max_gaussians);
    const std::vector<SparsePoint> points =
        DensePoints(scene, images, args.dense_points, {pool, none, silent, cancel}, still);
    scene.points.insert(scene.points.end(), points.begin(), points.end());
  }
  const double dense_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  GeometryProblem problem = GeometryProblemOf(scene, images, args.colors);
  problem.still = still;
  CurveRecorder recorder("reconstruct_geometry", silent, none);
  TrainingTrace trace;
  trace.score_training = true;
  ReducedScore reduced(args.score_side_px);
  if (!args.pictures_folder.empty()) std::filesystem::create_directories(args.pictures_folder);
  ScoreByMotion by_motion[2];
  trace.on_picture = [&](int view, const Image& drawn) {
    const Image truth = Truth(images, view, args.colors);
    const bool held_out = scene.views[view].held_out;
    if (still) {
      if (const auto region = still(view)) by_motion[held_out ? 1 : 0].Add(truth, drawn, *region);
    }
    if (held_out) reduced.Add(truth, drawn);
    if (args.pictures_folder.empty()) return;
    const auto file = std::filesystem::path(args.pictures_folder) /
                      (held_out ? "held_out" : "training") / (scene.views[view].name + ".png");
    std::filesystem::create_directories(file.parent_path());
    WriteFileAtomic(file, EncodePng8(SideBySide(truth, drawn)));
  };
  const GaussianModel model =
      TrainGeometry(problem, OptionsFrom(args), {pool, recorder, recorder, cancel}, &trace);
  if (!args.geometry_file.empty()) WriteFileAtomic(args.geometry_file, SerializeGaussians(model));
  nlohmann::ordered_json result = ToJson(args, trace);
  result["dense_seconds"] = dense_seconds;
  result["reduced"] = reduced.ToJson();
  if (still) {
    result["training"].update(by_motion[0].ToJson());
    result["reduced"].update(by_motion[1].ToJson());
  }
  for (const CurvePoint& p : recorder.points()) {
    if (p.error_name == "restored_non_finite") result["restored_at"].push_back(p.iteration);
    if (p.error_name == "moving_share") result["moving_share"] = p.value;
  }
  WriteResult(result, args.json_file);
}

}  // namespace

void AddReconstructCommand(CLI::App& app) {
  auto args = std::make_shared<ReconstructArguments>();
  CLI::App* command = app.add_subcommand(
      "reconstruct", "Measure quality of held-out views against seconds of training geometry");
  command->add_option("--scene", args->scene_folder, "Scene folder with poses")->required();
  command->add_option("--max-side", args->max_side_px, "Longer side of the working pictures, px");
  command
      ->add_option_function<std::string>(
          "--preset",
          [args](const std::string& name) { UsePreset(name, *args); },
          "Preset: fast, best or paper; later options override its values")
      ->check(CLI::IsMember({"fast", "best", "paper"}))
      ->trigger_on_parse();
  command->add_option("--threads", args->threads, "Number of threads");
  command->add_option("--imported", args->imported_file, "scene.json of an earlier import");
  command->add_option("--moving",
                      args->moving_folder,
                      "Folder of moving regions, as written by the import of a film with poses");
  command->add_option("--geometry", args->geometry_file, "File for the model");
  command->add_option(
      "--score-side", args->score_side_px, "Also score pictures reduced to this longer side, px");
  command->add_option("--hold-out-training",
                      args->set_aside,
                      "K/N: score every N-th training view from the K-th on, train on the others, "
                      "and ignore the scene's held-out views");
  command->add_option("--dense", args->dense, "Share of the initial Gaussians from plane sweeps");
  command->add_option(
      "--depth-side", args->dense_points.depth_side_px, "Longer side of the plane sweeps, px");
  command->add_option("--depth-tolerance",
                      args->dense_points.tolerance,
                      "Maximum relative difference of agreeing depths");
  command->add_option(
      "--depth-agreeing", args->dense_points.agreeing, "Number of neighbours that must agree");
  command->add_option(
      "--depth-sources", args->dense_points.depth_sources, "Number of neighbours per plane sweep");
  command->add_option("--depth-planes", args->dense_points.sweep.planes, "Number of planes");
  command->add_flag(
      "--cap", args->capped, "Limit Gaussians and iterations by the photos, as the service does");
  command->add_flag_callback(
      "--still",
      [args] { args->geometry.motion = GeometryOptions::Motion::kStill; },
      "Treat the scene as static");
  command
      ->add_option("--deformation",
                   args->geometry.deformation,
                   "Deformation of dynamic scenes: windows (the default) or hexplane")
      ->transform(CLI::Transformer(std::map<std::string, GeometryOptions::Deformation>{
          {"windows", GeometryOptions::Deformation::kWindows},
          {"hexplane", GeometryOptions::Deformation::kHexPlane}}));
  command
      ->add_option("--colors,--colours",
                   args->colors,
                   "Colours to train on: truth (RGB, the default) or luminance")
      ->transform(CLI::Transformer(std::map<std::string, TrainingColors>{
          {"truth", TrainingColors::kSrgb}, {"luminance", TrainingColors::kLuminance}}));
  CLI::Option* iterations =
      command->add_option("--iterations", args->geometry.iterations, "Number of iterations");
  command
      ->add_option("--seconds",
                   args->geometry.time_limit_seconds,
                   "Duration of training, s; the schedule is fitted to it")
      ->check(CLI::Range(0.0, 86'400.0));
  command->add_option(
      "--max-gaussians", args->geometry.max_gaussians, "Maximum number of Gaussians");
  command->add_option("--sh-degree", args->geometry.sh_degree, "Degree of the harmonics");
  command->add_option("--densify-gradient",
                      args->geometry.densify_gradient,
                      "Gradient from which Gaussians are densified, NDC units");
  command->add_option("--edge-weight", args->geometry.edge_weight, "Weight of the edge loss");
  command->add_option("--ssim-weight", args->geometry.ssim_weight, "Weight of SSIM");
  command->add_option("--seed", args->geometry.seed, "Seed");
  command->add_option(
      "--set", args->settings, "NAME=VALUE of the schedule (GeometryTuning); may be repeated");
  command->add_option("--pictures",
                      args->pictures_folder,
                      "Folder for pictures of held-out and training views: truth and render");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args, iterations] {
    if (args->geometry.time_limit_seconds > 0.0 && iterations->count() == 0) {
      args->geometry.iterations = 100'000;  // the most: time alone drives the schedule
    }
    RunReconstruct(*args);
  });
}

}  // namespace color3d
