// The grid solver of hints and fusion on stiff weights, compared with a dense solution in float64;
// and hints and fusion on pictures without a clue.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/base/random.h"
#include "core/carry/fusion.h"
#include "core/grid/grid_solver.h"
#include "core/keycolor/hints/hints.h"
#include "tests/stability/tiny_problem.h"
#include "tests/support/quiet_run.h"

namespace color3d {
namespace {

constexpr int kWidth = 20, kHeight = 15;
constexpr double kTolerance = 1e-6;

struct Problem {
  GridSystem system{kWidth, kHeight};
  std::vector<float> target;

  Problem(int width, int height)
      : system(width, height), target(2 * static_cast<size_t>(width) * height) {}
  Problem() : Problem(kWidth, kHeight) {}

  int64_t At(int x, int y) const { return static_cast<int64_t>(y) * system.width + x; }

  // Sets every edge inside the picture to weight(random number in 0..1).
  template <class Weight>
  void SetEdges(Weight weight) {
    Random random(3);
    for (int y = 0; y < system.height; ++y) {
      for (int x = 0; x < system.width; ++x) {
        const auto draw = [&] { return static_cast<float>(weight(random.NextUniform(0.0, 1.0))); };
        const bool right = x + 1 < system.width, down = y + 1 < system.height;
        if (right) system.right[At(x, y)] = draw();
        if (down) system.down[At(x, y)] = draw();
        if (right && down) system.down_right[At(x, y)] = draw();
        if (x > 0 && down) system.down_left[At(x, y)] = draw();
      }
    }
  }

  void Set(int64_t i, float a, float b, float data) {
    target[i] = a;
    target[system.PixelCount() + i] = b;
    system.data[i] = data;
  }

  void Pin(int64_t i, float a, float b) {
    if (system.pinned.empty()) system.pinned.resize(system.PixelCount());
    Set(i, a, b, 0.0f);
    system.pinned[i] = 1;
  }
};

// The normal matrix of all pixels, without pins.
Eigen::MatrixXd NormalMatrix(const GridSystem& s) {
  const int64_t n = s.PixelCount();
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
  const auto edge = [&](int64_t i, int64_t j, double w) {
    if (w == 0.0) return;
    m(i, i) += w;
    m(j, j) += w;
    m(i, j) -= w;
    m(j, i) -= w;
  };
  for (int64_t i = 0; i < n; ++i) {
    m(i, i) += s.data[i];
    edge(i, i + 1, s.right[i]);
    edge(i, i + s.width, s.down[i]);
    edge(i, i + s.width + 1, s.down_right[i]);
    edge(i, i + s.width - 1, s.down_left[i]);
  }
  return m;
}

struct DenseSolution {
  Eigen::MatrixXd u;  // pixels x 2
  double condition = 1.0;
};

// Eigenvalues below 1e-14 of the largest count as zero: their pixels are connected to nothing.
DenseSolution SolveDense(const Problem& p) {
  const GridSystem& s = p.system;
  const int64_t n = s.PixelCount();
  const Eigen::MatrixXd full = NormalMatrix(s);
  std::vector<int> free;
  DenseSolution solution{Eigen::MatrixXd::Zero(n, 2)};
  for (int64_t i = 0; i < n; ++i) {
    if (s.pinned.empty() || s.pinned[i] == 0) {
      free.push_back(static_cast<int>(i));
    } else {
      solution.u.row(i) << p.target[i], p.target[n + i];
    }
  }
  const auto count = static_cast<Eigen::Index>(free.size());
  if (count == 0) return solution;
  const Eigen::MatrixXd matrix = full(free, free);
  Eigen::MatrixXd right(count, 2);
  for (Eigen::Index k = 0; k < count; ++k) {
    for (int c = 0; c < 2; ++c) {
      right(k, c) = static_cast<double>(s.data[free[k]]) * p.target[c * n + free[k]] -
                    full.row(free[k]).dot(solution.u.col(c));
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  const double least = 1e-14 * eigen.eigenvalues().maxCoeff();
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(count);
  double smallest = eigen.eigenvalues().maxCoeff();
  for (Eigen::Index k = 0; k < count; ++k) {
    if (eigen.eigenvalues()[k] <= least) continue;
    inverse[k] = 1.0 / eigen.eigenvalues()[k];
    smallest = std::min(smallest, eigen.eigenvalues()[k]);
  }
  if (smallest > 0.0) solution.condition = eigen.eigenvalues().maxCoeff() / smallest;
  // One step of refinement.
  const auto apply = [&](const Eigen::MatrixXd& b) -> Eigen::MatrixXd {
    return eigen.eigenvectors() * inverse.asDiagonal() * (eigen.eigenvectors().transpose() * b);
  };
  Eigen::MatrixXd u = apply(right);
  u += apply(right - matrix * u);
  for (Eigen::Index k = 0; k < count; ++k) solution.u.row(free[k]) = u.row(k);
  return solution;
}

StabilityResult RunSolver(Problem p, ThreadPool& pool) {
  const DenseSolution expected = SolveDense(p);
  const int64_t n = p.system.PixelCount();
  const GridSolution found = SolveGridSystem(
      std::move(p.system), p.target, {kTolerance, 400}, pool, [](int, double) {}, {});
  StabilityResult r;
  r.condition = expected.condition;
  r.condition_of = "normal matrix";
  r.non_finite = CountNonFinite(found.u.data(), found.u.size());
  r.compared = 2 * n;
  const double largest = std::max(1e-30, expected.u.cwiseAbs().maxCoeff());
  r.value_error = 0.0;
  for (int64_t i = 0; i < n; ++i) {
    for (int c = 0; c < 2; ++c) {
      r.value_error = std::max(r.value_error, std::abs(found.u[c * n + i] - expected.u(i, c)));
    }
  }
  r.value_error /= largest;
  // The solver ends at this residual in the energy norm.
  r.value_bound = std::max(kTolerance * std::sqrt(r.condition), 4.0 * kFloatEpsilon);
  r.outcome = std::to_string(found.iterations) + " iterations" +
              (found.converged ? "" : ", as low as float32 allows");
  return r;
}

// Solutions are within the range of the known colours. The error is the excess, relative to it.
StabilityResult WithinRange(const Image& ab, double lowest, double highest, double bound) {
  StabilityResult r;
  r.condition_of = "-";
  r.non_finite = CountNonFinite(ab.data.data(), ab.data.size());
  r.compared = static_cast<int64_t>(ab.data.size());
  r.value_error = 0.0;
  for (const float v : ab.data) {
    r.value_error = std::max({r.value_error, lowest - v, v - highest});
  }
  r.value_error /= std::max(1.0, highest - lowest);
  r.value_bound = bound;
  return r;
}

Image Checkerboard(int width, int height) {
  Image l(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) l.At(0, y, x) = (x + y) % 2 == 0 ? 0.0f : 100.0f;
  }
  return l;
}

StabilityResult RunHints(const Image& luminance, const std::vector<ColorHint>& hints) {
  QuietRun run;
  const HintSolution solution = KeyColorFromHints(luminance, hints, {}, run.control());
  double lowest = 0.0, highest = 0.0;
  for (const ColorHint& hint : hints) {
    lowest = std::min({lowest, hint.a, hint.b});
    highest = std::max({highest, hint.a, hint.b});
  }
  StabilityResult r = WithinRange(solution.ab, lowest, highest, 1e-3);
  r.outcome = std::to_string(solution.iterations) + " iterations";
  return r;
}

struct Sources {
  Image luminance = Texture(48, 36, 0);
  CarriedColor carried{Image(48, 36, 2), Image(48, 36, 1)};
  Image inferred = Image(48, 36, 2);
  Image distance = Image(48, 36, 1);
  Image guessed;
};

StabilityResult RunFusion(const Sources& s, double lowest, double highest, ThreadPool& pool) {
  const FusedColor fused = FuseColors(
      {s.luminance, s.carried, s.inferred, s.distance, s.guessed}, FusionOptions(), pool, {});
  StabilityResult r = WithinRange(fused.ab, lowest, highest, 1e-3);
  r.non_finite += CountNonFinite(fused.provenance.data.data(), fused.provenance.data.size());
  return r;
}

void AddSolverCases(std::vector<StabilityCase>& cases) {
  const auto add = [&](const std::string& name, auto make) {
    cases.push_back(
        {"grid", name, false, [make](ThreadPool& pool) { return RunSolver(make(), pool); }});
  };
  // Some pixels have colours in -40..40, with weight `data`.
  const auto known = [](Problem* p, float data) {
    Random random(7);
    for (int64_t i = 0; i < p->system.PixelCount(); i += 7) {
      p->Set(i,
             static_cast<float>(random.NextUniform(-40.0, 40.0)),
             static_cast<float>(random.NextUniform(-40.0, 40.0)),
             data);
    }
  };
  add("ordinary weights", [known] {
    Problem p;
    p.SetEdges([](double u) { return 0.1 + u; });
    known(&p, 0.5f);
    return p;
  });
  add("edge weights of 10^6:1", [known] {
    Problem p;
    p.SetEdges([](double u) { return std::pow(10.0, -6.0 * u); });
    known(&p, 0.5f);
    return p;
  });
  add("edge weights of 10^12:1", [known] {
    Problem p;
    p.SetEdges([](double u) { return std::pow(10.0, -12.0 * u); });
    known(&p, 0.5f);
    return p;
  });
  add("data weights of 1e-6", [known] {
    Problem p;
    p.SetEdges([](double) { return 1.0; });
    known(&p, 1e-6f);
    return p;
  });
  add("one pinned pixel, edges of 10^4:1", [] {
    Problem p;
    p.SetEdges([](double u) { return std::pow(10.0, -4.0 * u); });
    p.Pin(p.At(2, 3), 60.0f, -35.0f);
    return p;
  });
  add("an island that nothing known touches", [] {
    Problem p;
    p.SetEdges([](double) { return 1.0; });
    p.Pin(p.At(2, 3), 60.0f, -35.0f);
    for (int y = 0; y < kHeight; ++y) {  // cuts the last five columns off
      const int64_t i = p.At(kWidth - 6, y);
      p.system.right[i] = p.system.down_right[i] = 0.0f;
      p.system.down_left[i + 1] = 0.0f;
    }
    return p;
  });
  add("a strip of 600 pixels, its ends pinned", [] {
    Problem p(600, 1);
    p.SetEdges([](double) { return 1.0; });
    p.Pin(0, -50.0f, 50.0f);
    p.Pin(599, 50.0f, 50.0f);
    return p;
  });
  add("nothing known", [] {
    Problem p;
    p.SetEdges([](double) { return 1.0; });
    return p;
  });
  add("a single pixel", [] {
    Problem p(1, 1);
    p.Set(0, 12.0f, -7.0f, 1e-20f);
    return p;
  });
}

void AddPictureCases(std::vector<StabilityCase>& cases) {
  const auto hints = [&](const std::string& name, auto make, std::vector<ColorHint> list) {
    cases.push_back(
        {"hints", name, false, [make, list](ThreadPool&) { return RunHints(make(), list); }});
  };
  const ColorHint red{.x_px = 20, .y_px = 20, .radius_px = 1, .a = 70, .b = 50};
  const ColorHint blue{.x_px = 70, .y_px = 50, .radius_px = 1, .a = 20, .b = -90};
  hints("one dot on a black and white checkerboard", [] { return Checkerboard(96, 72); }, {red});
  hints("two colours on a constant picture", [] { return Image(96, 72, 1, 50.0f); }, {red, blue});
  hints("a black picture", [] { return Image(96, 72, 1, 0.0f); }, {red, blue});
  hints("two colours on grain of 100 L",
        [] {
          Image l(96, 72, 1);
          Random random(5);
          for (float& v : l.data) v = static_cast<float>(random.NextUniform(0.0, 100.0));
          return l;
        },
        {red, blue});

  const auto fusion = [&](const std::string& name, double lowest, double highest, auto change) {
    cases.push_back({"fusion", name, false, [=](ThreadPool& pool) {
                       Sources s;
                       change(&s);
                       return RunFusion(s, lowest, highest, pool);
                     }});
  };
  fusion("nothing carried, nothing inferred", 0.0, 0.0, [](Sources*) {});
  fusion("one carried pixel of confidence 1e-30", 0.0, 60.0, [](Sources* s) {
    s->carried.ab.At(0, 5, 5) = 60.0f;
    s->carried.confidence.At(0, 5, 5) = 1e-30f;
  });
  fusion("carried in each second pixel, opposite hues", -60.0, 60.0, [](Sources* s) {
    for (size_t i = 0; i < s->carried.confidence.data.size(); i += 2) {
      s->carried.confidence.data[i] = 1.0f;
      s->carried.ab.data[i] = i % 4 == 0 ? 60.0f : -60.0f;
    }
  });
  fusion("inferred at feature distances of 1e30", -80.0, 80.0, [](Sources* s) {
    s->inferred = Image(48, 36, 2, 80.0f);
    s->distance = Image(48, 36, 1, 1e30f);
    s->guessed = Image(48, 36, 2, -80.0f);
  });
  fusion("luminance of a checkerboard", 0.0, 60.0, [](Sources* s) {
    s->luminance = Checkerboard(48, 36);
    s->carried.ab = Image(48, 36, 2, 60.0f);
    s->carried.confidence.At(0, 18, 24) = 1.0f;
  });
}

}  // namespace

void AddGridCases(std::vector<StabilityCase>& cases) {
  AddSolverCases(cases);
  AddPictureCases(cases);
}

}  // namespace color3d
