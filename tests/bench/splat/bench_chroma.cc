// color3d-bench chroma: error against seconds of the chroma solvers, on one geometry with the true
// chroma of the training views.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/metrics/quality.h"
#include "core/scene/import/import.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/raster/render.h"
#include "core/stage/run_stages.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"
#include "tests/support/quiet_run.h"

namespace color3d {
namespace {

using Json = nlohmann::ordered_json;

struct ChromaArguments {
  std::string scene_folder;
  std::string json_file;
  std::string geometry_file;
  int max_side_px = 500;
  int threads = 2;
  int adam_iterations = 15'000;
  int preset_iterations = 300;
  int memory_budget_mib = 2048;
  std::string runs = "closed,cg,adam-preset,adam";
  std::vector<int> degrees = {0, 1};
  GeometryOptions geometry{.iterations = 3000, .max_gaussians = 150'000};
  ChromaOptions chroma{.iterations = 600};
};

// CPU time of all threads, which a busy machine disturbs less than wall time.
double CpuSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Records the curves of the solver over its own time.
class SolverCurves : public NullObserver {
 public:
  explicit SolverCurves(std::function<double()> seconds) : seconds_(std::move(seconds)) {}
  void OnError(int64_t iteration, const std::string& name, double value) override {
    curve_.push_back(
        {{"seconds", seconds_()}, {"iteration", iteration}, {"name", name}, {"value", value}});
  }
  void OnWarning(const std::string& message) override { warnings_.push_back(message); }
  Json curve_ = Json::array(), warnings_ = Json::array();

 private:
  std::function<double()> seconds_;
};

class ChromaBench {
 public:
  explicit ChromaBench(const ChromaArguments& args)
      : args_(args), imported_(Import()), pool_(args.threads) {
    const ViewImages images(imported_.scene, args.scene_folder, args.max_side_px);
    for (size_t i = 0; i < imported_.scene.views.size(); ++i) {
      const int view = static_cast<int>(i);
      truth_.push_back(LabFromSrgb(images.Srgb(view)));
      cameras_.push_back(images.WorkingCamera(view));
    }
    TrainOrReadGeometry(images);
    for (const int view : imported_.scene.TrainingViews()) {
      problem_.training.push_back(
          {view, cameras_[view], imported_.scene.views[view].cam_from_world});
      auto target = std::make_shared<ChromaTarget>();
      target->ab = Image(truth_[view].width, truth_[view].height, 2);
      std::copy_n(truth_[view].Plane(1), target->ab.data.size(), target->ab.data.begin());
      targets_[view] = std::move(target);
    }
    problem_.targets = [this](int view) { return targets_.at(view); };
  }

  Json Run() {
    Json result{{"scene", args_.scene_folder},
                {"max_side_px", args_.max_side_px},
                {"threads", args_.threads},
                {"gaussians", geometry_.size()},
                {"training_views", problem_.training.size()},
                {"held_out_views", imported_.scene.HeldOutViews().size()}};
    std::istringstream names(args_.runs);
    for (std::string name; std::getline(names, name, ',');) {
      for (const int degree : args_.degrees) {
        ChromaOptions options = args_.chroma;
        options.chroma_sh_degree = degree;
        options.memory_budget_bytes = int64_t{args_.memory_budget_mib} << 20;
        const bool adam = name == "adam" || name == "adam-preset";
        if (adam) options.solver = ChromaOptions::Solver::kAdam;
        if (name == "closed") options.iterations = 0;
        if (name == "adam") options.iterations = args_.adam_iterations;
        if (name == "adam-preset") options.iterations = args_.preset_iterations;
        if (!adam && name != "closed" && name != "cg") {
          throw InvalidArgument("--runs: \"" + name +
                                "\" is not one of closed, cg, adam-preset, adam");
        }
        result["runs"].push_back(RunOne(name, options));
      }
    }
    return result;
  }

 private:
  ImportResult Import() const {
    QuietRun run;
    const ScratchFolder scratch;
    ImportOptions options;
    options.hold_out_every_eighth = true;
    return ImportScene(args_.scene_folder, scratch.path(), options, run.control());
  }

  void TrainOrReadGeometry(const ViewImages& images) {
    if (!args_.geometry_file.empty() && std::filesystem::exists(args_.geometry_file)) {
      geometry_ = ParseGaussians(ReadFile(args_.geometry_file));
      return;
    }
    NullObserver silent;
    NoCheckpoints none;
    geometry_ = TrainGeometry(GeometryProblemOf(imported_.scene, images),
                              args_.geometry,
                              {pool_, none, silent, CancellationToken()});
    if (!args_.geometry_file.empty()) {
      WriteFileAtomic(args_.geometry_file, SerializeGaussians(geometry_));
    }
  }

  double TrainL1(const GaussianModel& model) {
    double sum = 0.0, count = 0.0;
    for (const PosedCamera& view : problem_.training) {
      const Image rendered = RenderView(model, view.camera, view.cam_from_world, pool_).lab;
      const Image& truth = truth_[view.view];
      for (size_t i = truth.PlaneSize(); i < truth.data.size(); ++i) {
        sum += std::abs(rendered.data[i] - truth.data[i]);
      }
      count += 2.0 * static_cast<double>(truth.PlaneSize());
    }
    return sum / count;
  }

  Json Score(const GaussianModel& model) {
    const std::vector<int> held_out = imported_.scene.HeldOutViews();
    std::vector<double> delta(held_out.size()), psnr(held_out.size()), l1(held_out.size());
    for (size_t k = 0; k < held_out.size(); ++k) {
      const int view = held_out[k];
      const Image& truth = truth_[view];
      Image lab =
          RenderView(model, cameras_[view], imported_.scene.views[view].cam_from_world, pool_).lab;
      psnr[k] = Psnr(SrgbFromLab(lab), SrgbFromLab(truth), 1.0);
      for (size_t i = truth.PlaneSize(); i < truth.data.size(); ++i) {
        l1[k] +=
            std::abs(lab.data[i] - truth.data[i]) / (2.0 * static_cast<double>(truth.PlaneSize()));
      }
      std::copy_n(truth.Plane(0), truth.PlaneSize(), lab.Plane(0));
      delta[k] = MeanDeltaE00(lab, truth);
    }
    const auto mean = [](const std::vector<double>& values) {
      double sum = 0.0;
      for (const double v : values) sum += v;
      return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
    };
    return {{"train_l1_ab", TrainL1(model)},
            {"heldout_l1_ab", mean(l1)},
            {"heldout_delta_e00_chroma", mean(delta)},
            {"heldout_psnr_rgb", mean(psnr)}};
  }

  Json RunOne(const std::string& name, const ChromaOptions& options) {
    const auto start = std::chrono::steady_clock::now();
    const double cpu_start = CpuSeconds();
    double paused = 0.0, cpu_paused = 0.0;  // while scoring
    const auto since_start = [&] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    Json points = Json::array();
    problem_.snapshot = [&](int64_t iteration, const std::function<GaussianModel()>& model) {
      const double now = since_start(), cpu_now = CpuSeconds();
      Json point = Score(model());
      point["seconds"] = now - paused;
      point["cpu_seconds"] = cpu_now - cpu_start - cpu_paused;
      point["iteration"] = iteration;
      std::fprintf(stderr, "%s\n", point.dump().c_str());
      points.push_back(std::move(point));
      paused += since_start() - now;
      cpu_paused += CpuSeconds() - cpu_now;
    };
    NoCheckpoints none;
    SolverCurves curves([&] { return since_start() - paused; });
    const GaussianModel model =
        FitChroma(geometry_, problem_, options, {pool_, none, curves, CancellationToken()});
    const double seconds = since_start() - paused;
    const double cpu_seconds = CpuSeconds() - cpu_start - cpu_paused;
    Json last = Score(model);
    last["seconds"] = seconds;
    last["cpu_seconds"] = cpu_seconds;
    std::fprintf(stderr,
                 "%-12s degree %d: %s\n",
                 name.c_str(),
                 options.chroma_sh_degree,
                 last.dump().c_str());
    return {{"run", name},
            {"chroma_sh_degree", options.chroma_sh_degree},
            {"iterations", options.iterations},
            {"seconds", seconds},
            {"cpu_seconds", cpu_seconds},
            {"end", last},
            {"curve", points},
            {"solver_curve", curves.curve_},
            {"warnings", curves.warnings_}};
  }

  const ChromaArguments& args_;
  ImportResult imported_;
  ThreadPool pool_;
  std::vector<Image> truth_;  // Lab
  std::vector<Camera> cameras_;
  std::map<int, std::shared_ptr<const ChromaTarget>> targets_;
  GaussianModel geometry_;
  ChromaProblem problem_;
};

void RunChromaBench(const ChromaArguments& args) {
  WriteResult(ChromaBench(args).Run(), args.json_file);
}

}  // namespace

void AddChromaCommand(CLI::App& app) {
  auto args = std::make_shared<ChromaArguments>();
  CLI::App* command = app.add_subcommand(
      "chroma", "Measure error against seconds of the chroma solvers on one geometry");
  command
      ->add_option("--scene", args->scene_folder, "Folder of colour photos, with or without poses")
      ->required();
  command->add_option("--max-side", args->max_side_px, "Longer side of the working pictures, px");
  command->add_option("--threads", args->threads, "Number of threads");
  command->add_option(
      "--max-gaussians", args->geometry.max_gaussians, "Maximum number of Gaussians");
  command->add_option("--geometry-iterations",
                      args->geometry.iterations,
                      "Training iterations of the luminance Gaussians");
  command->add_option(
      "--geometry", args->geometry_file, "Geometry file; read if it exists, else written");
  command->add_option("--runs", args->runs, "Solvers: any of closed,cg,adam-preset,adam");
  command->add_option("--degrees", args->degrees, "Degrees of the chroma harmonics: 0, 1")
      ->delimiter(',');
  command->add_option("--adam-iterations", args->adam_iterations, "Iterations of adam");
  command->add_option("--preset-iterations", args->preset_iterations, "Iterations of adam-preset");
  command->add_option(
      "--iterations", args->chroma.iterations, "Maximum number of iterations of cg");
  command->add_option("--sweeps", args->chroma.sweeps, "Sweeps over ordered subsets");
  command->add_option("--rounds", args->chroma.rounds, "Maximum number of rounds of reweighting");
  command->add_option("--steps",
                      args->chroma.steps_per_round,
                      "Maximum number of conjugate gradient steps per round");
  command->add_option("--residual-tolerance",
                      args->chroma.residual_tolerance,
                      "Relative residual at which a round ends");
  command->add_option("--objective-tolerance",
                      args->chroma.objective_tolerance,
                      "Relative improvement at which the solver ends");
  command->add_option("--tikhonov", args->chroma.tikhonov, "Pull towards the start, in pixels");
  command->add_option("--tikhonov-rest", args->chroma.tikhonov_rest, "The same above degree 0");
  command->add_option(
      "--memory-budget-mib", args->memory_budget_mib, "Memory for blending weights, MiB");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args] { RunChromaBench(*args); });
}

}  // namespace color3d
