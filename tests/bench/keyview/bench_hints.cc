// color3d-bench hints: colour hints on real photographs and a procedural picture. Measures
// residual against time of our solver and of Eigen's conjugate gradients with incomplete Cholesky,
// by size, and the colour error by the number of hints.
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/color/difference.h"
#include "core/color/lab.h"
#include "core/grid/edge_weights.h"
#include "core/image/codec.h"
#include "core/keycolor/hints/hints.h"
#include "tests/bench/commands.h"
#include "tests/bench/result_file.h"

namespace color3d {
namespace {

using Json = nlohmann::ordered_json;

struct HintsArguments {
  std::vector<std::string> photos;
  std::vector<double> megapixels{0.25, 1, 4, 12};
  std::vector<int> counts{10, 50, 200};
  int points = 50;
  double noise = 1.0;
  double eigen_up_to_megapixels = 1.0;
  double eigen_seconds = 60.0;
  bool quality = false;
  std::string pictures_folder;
  std::string json_file;
  int threads = 0;
  HintOptions options;
};

class Clock {
 public:
  double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

class ResidualCurve : public NullObserver {
 public:
  void OnError(int64_t, const std::string&, double value) override {
    points.push_back({clock_.Seconds(), value});
  }
  Json points = Json::array();

 private:
  Clock clock_;
};

// Discs, ramps and a checkered floor: flat regions, fine detail and hard edges.
Image ProceduralSrgb(int width, int height) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = static_cast<double>(x) / width, v = static_cast<double>(y) / height;
      const int disc = static_cast<int>(std::hypot(u - 0.4, v - 0.3) * 12.0);
      const bool floor = v > 0.6, dark = (static_cast<int>(u * 40) + static_cast<int>(v * 40)) % 2;
      lab.At(0, y, x) =
          static_cast<float>(floor ? (dark ? 30.0 : 75.0) : 45.0 + 30.0 * u + (disc % 2) * 12.0);
      lab.At(1, y, x) = static_cast<float>(floor ? (dark ? 25.0 : -5.0) : 20.0 * std::cos(disc));
      lab.At(2, y, x) = static_cast<float>(floor ? 15.0 : 30.0 * std::sin(disc));
    }
  }
  return SrgbFromLab(lab);
}

Image LoadPhoto(const std::string& photo, double megapixels) {
  if (photo == "procedural") {
    const int side = static_cast<int>(std::sqrt(megapixels * 1e6));
    return ProceduralSrgb(side, side);
  }
  const Image srgb = ReadImage(photo);
  const double scale = std::sqrt(megapixels * 1e6 / static_cast<double>(srgb.PlaneSize()));
  return Resize(srgb,
                static_cast<int>(std::lround(srgb.width * scale)),
                static_cast<int>(std::lround(srgb.height * scale)));
}

struct Problem {
  Image lab;
  Image luminance;
  std::vector<ColorHint> hints;
};

// True colours at random pixels. Adds noise, since enlarged photos lack grain.
Problem MakeProblem(const Image& srgb, int points, double noise) {
  Problem problem{LabFromSrgb(srgb), Image(srgb.width, srgb.height, 1), {}};
  std::copy_n(
      problem.lab.data.begin(), problem.luminance.data.size(), problem.luminance.data.begin());
  Random random(7);
  for (float& l : problem.luminance.data) {
    if (noise > 0.0) l += static_cast<float>(noise * random.NextNormal());
  }
  for (int k = 0; k < points; ++k) {
    const auto x = static_cast<int>(random.NextBelow(srgb.width));
    const auto y = static_cast<int>(random.NextBelow(srgb.height));
    problem.hints.push_back(
        {x + 0.5, y + 0.5, 0.0, problem.lab.At(1, y, x), problem.lab.At(2, y, x)});
  }
  return problem;
}

bool HintsHoldExactly(const Problem& problem, const Image& ab) {
  return std::all_of(problem.hints.begin(), problem.hints.end(), [&](const ColorHint& hint) {
    const int x = static_cast<int>(hint.x_px), y = static_cast<int>(hint.y_px);
    return ab.At(0, y, x) == static_cast<float>(hint.a) &&
           ab.At(1, y, x) == static_cast<float>(hint.b);
  });
}

Json RunOurs(const Problem& problem, const HintOptions& options, ThreadPool& pool) {
  NoCheckpoints none;
  ResidualCurve curve;
  const Clock clock;
  const HintSolution solution =
      KeyColorFromHints(problem.luminance, problem.hints, options, {pool, none, curve, {}});
  const double seconds = clock.Seconds();
  return {{"solver", "aggregation multigrid"},
          {"seconds", seconds},
          {"iterations", solution.iterations},
          {"relative_residual", solution.relative_residual},
          {"hints_exact", HintsHoldExactly(problem, solution.ab)},
          {"peak_gb", PeakMemoryBytes() / 1e9},
          {"residual_by_seconds", curve.points}};
}

using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

// The same system for Eigen: one unknown per pixel without hint, right-hand side for a.
void AssembleForEigen(const Problem& problem, double sigma, Matrix& matrix, Eigen::VectorXd& b) {
  ThreadPool pool(1);
  const GridSystem s = SystemOfLuminance(problem.luminance, sigma, pool);
  const int64_t n = s.PixelCount();
  std::vector<int> index(n, 0);
  std::vector<double> hint(n, 0.0);
  for (const ColorHint& h : problem.hints) {
    const int64_t i = static_cast<int64_t>(h.y_px) * s.width + static_cast<int64_t>(h.x_px);
    index[i] = -1;
    hint[i] = static_cast<float>(h.a);
  }
  int unknowns = 0;
  for (int& i : index) i = i < 0 ? -1 : unknowns++;
  b = Eigen::VectorXd::Zero(unknowns);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(9 * n);
  const auto one_way = [&](int64_t i, int64_t j, double w) {
    if (index[i] < 0) return;
    entries.emplace_back(index[i], index[i], w);
    if (index[j] >= 0) entries.emplace_back(index[i], index[j], -w);
    if (index[j] < 0) b[index[i]] += w * hint[j];
  };
  const auto edge = [&](int64_t i, int64_t j, double w) {
    if (w == 0.0) return;
    one_way(i, j, w);
    one_way(j, i, w);
  };
  for (int64_t i = 0; i < n; ++i) {
    edge(i, i + 1, s.right[i]);
    edge(i, i + s.width, s.down[i]);
    edge(i, i + s.width + 1, s.down_right[i]);
    edge(i, i + s.width - 1, s.down_left[i]);
  }
  matrix.resize(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
}

// Eigen's ConjugateGradient step by step, to measure residual against time. Solves one component,
// ours two.
Json RunEigen(const Problem& problem, const HintsArguments& args) {
  Matrix a;
  Eigen::VectorXd b;
  const Clock clock;
  AssembleForEigen(problem, args.options.sigma, a, b);
  const Eigen::IncompleteCholesky<double> preconditioner(a);
  Json points = Json::array();
  Eigen::VectorXd u = Eigen::VectorXd::Zero(b.size()), r = b, z = preconditioner.solve(r), p = z;
  double rz = r.dot(z), residual = 1.0;
  int iterations = 0;
  while (residual > args.options.tolerance && clock.Seconds() < args.eigen_seconds) {
    const Eigen::VectorXd ap = a * p;
    const double alpha = rz / p.dot(ap);
    u += alpha * p;
    r -= alpha * ap;
    z = preconditioner.solve(r);
    const double next = r.dot(z);
    p = z + (next / rz) * p;
    rz = next;
    residual = r.norm() / b.norm();
    if (++iterations % 10 == 0) points.push_back({clock.Seconds(), residual});
  }
  return {{"solver", "Eigen CG + IncompleteCholesky (one component)"},
          {"seconds", clock.Seconds()},
          {"iterations", iterations},
          {"relative_residual", residual},
          {"residual_by_seconds", points}};
}

Json RunSizes(const HintsArguments& args) {
  Json results = Json::array();
  for (const std::string& photo : args.photos) {
    for (const double megapixels : args.megapixels) {
      const Problem problem = MakeProblem(LoadPhoto(photo, megapixels), args.points, args.noise);
      Json entry{{"photo", photo},
                 {"width", problem.luminance.width},
                 {"height", problem.luminance.height},
                 {"points", args.points}};
      ThreadPool pool(args.threads);
      entry["ours"] = RunOurs(problem, args.options, pool);
      if (megapixels <= args.eigen_up_to_megapixels) entry["eigen"] = RunEigen(problem, args);
      results.push_back(entry);
    }
  }
  return results;
}

Json RunQuality(const HintsArguments& args) {
  Json results = Json::array();
  for (const std::string& photo : args.photos) {
    const Image srgb = ReadImage(photo);
    for (const int count : args.counts) {
      const Problem problem = MakeProblem(srgb, count, 0.0);
      ThreadPool pool(args.threads);
      NoCheckpoints none;
      NullObserver ignore;
      const HintSolution solution = KeyColorFromHints(
          problem.luminance, problem.hints, args.options, {pool, none, ignore, {}});
      const Image colored = JoinLab(problem.luminance, solution.ab);
      const Image gray = JoinLab(problem.luminance, Image(srgb.width, srgb.height, 2));
      results.push_back({{"photo", photo},
                         {"points", count},
                         {"delta_e00", MeanDeltaE00(colored, problem.lab)},
                         {"delta_e00_of_gray", MeanDeltaE00(gray, problem.lab)}});
      if (args.pictures_folder.empty()) continue;
      const std::filesystem::path file = photo;
      WriteFileAtomic(std::filesystem::path(args.pictures_folder) /
                          (file.stem().string() + "_" + std::to_string(count) + ".png"),
                      EncodePng8(SrgbFromLab(colored)));
    }
  }
  return results;
}

}  // namespace

void AddHintsCommand(CLI::App& app) {
  auto args = std::make_shared<HintsArguments>();
  CLI::App* command =
      app.add_subcommand("hints", "Measure residual against seconds, or error, of colour hints");
  command->add_option("photos", args->photos, "Picture files, or 'procedural'")->required();
  command->add_option("--megapixels", args->megapixels, "Sizes to resample to");
  command->add_option("--points", args->points, "Number of hints of the timed runs");
  command->add_option("--noise", args->noise, "Standard deviation of noise added to L");
  command->add_option("--eigen-up-to",
                      args->eigen_up_to_megapixels,
                      "Maximum size for the comparison with Eigen, megapixels");
  command->add_option("--eigen-seconds", args->eigen_seconds, "Time limit of Eigen, s");
  command->add_option("--tolerance", args->options.tolerance, "Relative residual to reach");
  command->add_option("--sigma", args->options.sigma, "Sigma of the edge weights, L units");
  command->add_option("--threads", args->threads, "Number of threads; 0: one per core");
  command->add_flag("--quality", args->quality, "Measure the error by number of hints instead");
  command->add_option("--counts", args->counts, "Numbers of hints, with --quality");
  command->add_option("--pictures", args->pictures_folder, "Folder for PNGs, with --quality");
  command->add_option(
      "--json", args->json_file, "File for the result (JSON); default: standard output");
  command->callback([args] {
    WriteResult(args->quality ? RunQuality(*args) : RunSizes(*args), args->json_file);
  });
}

}  // namespace color3d
