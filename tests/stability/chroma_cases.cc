// Chroma on fixed geometry with singular normal equations: results are finite, and plausible where
// no pixel determines them.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>

#include "core/splat/chroma/chroma_fit.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/raster/raster_camera.h"
#include "tests/stability/tiny_problem.h"

namespace color3d {
namespace {

constexpr int kSide = 48;
constexpr float kA = 35.0f, kB = -20.0f;  // targets, Lab units

struct Fit {
  GaussianModel geometry = CloudOf(150, 9);
  std::vector<PosedCamera> cameras;
  std::function<std::shared_ptr<const ChromaTarget>(int view)> target;
  ChromaOptions options;
  bool singular = false;  // beyond what NormalMatrixCondition sees
};

std::shared_ptr<ChromaTarget> OneColor(float a, float b, float weight) {
  auto target = std::make_shared<ChromaTarget>();
  target->ab = Image(kSide, kSide, 2, a);
  std::fill_n(target->ab.Plane(1), target->ab.PlaneSize(), b);
  if (weight != 1.0f) target->weight = Image(kSide, kSide, 1, weight);
  return target;
}

Fit Ordinary() {
  Fit f;
  for (int i = 0; i < 3; ++i) f.cameras.push_back(OrbitCamera(i, kSide, kSide, 0.2 * i));
  f.target = [](int) { return OneColor(kA, kB, 1.0f); };
  f.options.iterations = 40;
  return f;
}

Fit Singular() {
  Fit f = Ordinary();
  f.singular = true;
  return f;
}

// Condition number of the normal equations of one chroma channel's constant terms. Column i is the
// picture of Gaussian i alone, in white; float32 columns resolve condition numbers up to about
// 1e14.
double NormalMatrixCondition(const Fit& f, ThreadPool& pool) {
  const int count = static_cast<int>(f.geometry.size());
  ParameterBlock p = ParametersFromModel(f.geometry);
  ColorSpec color;
  color.channel[0].base = 0.0f;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
  SplatPipeline pipeline;
  for (const PosedCamera& camera : f.cameras) {
    const RasterCamera raster = MakeRasterCamera(camera.camera, camera.cam_from_world);
    Eigen::MatrixXd columns(kSide * kSide, count);
    for (int i = 0; i < count; ++i) {
      std::fill_n(p.Row(kColorRow), count, 0.0f);
      p.Row(kColorRow)[i] = 1.0f;
      const float black = 0.0f;
      pipeline.Forward({p, color, raster}, &black, false, pool);
      for (int y = 0; y < kSide; ++y) {
        columns.col(i).segment(y * kSide, kSide) =
            Eigen::Map<const Eigen::VectorXf>(pipeline.color().Row(0, y), kSide).cast<double>();
      }
    }
    normal += columns.transpose() * columns;
  }
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(normal, Eigen::EigenvaluesOnly).eigenvalues();
  return values[0] > 1e-14 * values[count - 1] ? values[count - 1] / values[0]
                                               : std::numeric_limits<double>::infinity();
}

// Largest chroma among the Gaussians, Lab units, of the constant terms.
double LargestChroma(const GaussianModel& model) {
  const double scale = 255.0 * kShDc;
  const size_t stride = model.sh_a.size() / std::max<size_t>(1, model.size());
  double largest = 0.0;
  for (size_t i = 0; i < model.size(); ++i) {
    largest = std::max(largest,
                       std::hypot(scale * model.sh_a[i * stride], scale * model.sh_b[i * stride]));
  }
  return largest;
}

StabilityResult Run(const Fit& f, ThreadPool& pool) {
  ChromaProblem problem;
  problem.training = f.cameras;
  problem.targets = f.target;
  TrainingWitness witness;
  NoCheckpoints none;
  const GaussianModel model =
      FitChroma(f.geometry, problem, f.options, {pool, none, witness, CancellationToken()});
  StabilityResult result;
  result.condition =
      f.singular ? std::numeric_limits<double>::infinity() : NormalMatrixCondition(f, pool);
  result.condition_of = "normal matrix";
  result.non_finite = CountNonFinite(model) + witness.non_finite;
  result.compared = static_cast<int64_t>(model.size());
  // Implausible chroma is far beyond that of the targets; the gamut ends near 130.
  const double largest = LargestChroma(model);
  result.restores = witness.restores;
  result.held = model.channels == 3 && largest < 260.0;
  char text[120];
  std::snprintf(text,
                sizeof(text),
                "largest chroma %.3g of %.3g, %zu warnings",
                largest,
                std::hypot(kA, kB),
                witness.warnings.size());
  result.outcome = text;
  return result;
}

// Half of the Gaussians are far behind all cameras.
Fit WithUnseen() {
  Fit f = Singular();
  for (size_t i = 0; i < f.geometry.size(); i += 2) f.geometry.position[3 * i + 2] = -50.0f;
  return f;
}

Fit NothingSeen() {
  Fit f = Singular();
  for (size_t i = 0; i < f.geometry.size(); ++i) f.geometry.position[3 * i + 2] = -50.0f;
  return f;
}

// Each Gaussian twice: only the sum of each pair's colours is determined.
Fit WithDuplicates() {
  Fit f = Singular();
  const GaussianModel once = f.geometry;
  for (auto member : {&GaussianModel::position,
                      &GaussianModel::log_scale,
                      &GaussianModel::rotation,
                      &GaussianModel::opacity_logit,
                      &GaussianModel::sh_l}) {
    std::vector<float>& to = f.geometry.*member;
    const std::vector<float>& from = once.*member;
    to.insert(to.end(), from.begin(), from.end());
  }
  return f;
}

// Opacities from invisible to solid: the diagonal spans many decades.
Fit BadlyScaled() {
  Fit f = Ordinary();
  for (size_t i = 0; i < f.geometry.size(); ++i) {
    f.geometry.opacity_logit[i] = static_cast<float>(i % 3) * 8.0f - 5.4f;
    for (size_t k = 0; k < 3; ++k) f.geometry.log_scale[3 * i + k] = i % 2 == 0 ? -9.0f : 0.0f;
  }
  return f;
}

}  // namespace

void AddChromaCases(std::vector<StabilityCase>& cases) {
  const auto add = [&](const std::string& name, std::function<Fit()> make) {
    cases.push_back(
        {"chroma", name, false, [make](ThreadPool& pool) { return Run(make(), pool); }});
  };
  add("ordinary", Ordinary);
  add("half of the Gaussians unseen", WithUnseen);
  add("no Gaussian seen", NothingSeen);
  add("every Gaussian twice", WithDuplicates);
  add("opacities and sizes badly scaled", BadlyScaled);
  add("all weights zero", [] {
    Fit f = Singular();
    f.target = [](int) { return OneColor(kA, kB, 0.0f); };
    return f;
  });
  add("weights of 1e-30", [] {
    Fit f = Singular();
    f.target = [](int) { return OneColor(kA, kB, 1e-30f); };
    return f;
  });
  add("no view has colours", [] {
    Fit f = Singular();
    f.target = [](int) { return std::shared_ptr<const ChromaTarget>(); };
    return f;
  });
  add("one view, degree 1", [] {
    Fit f = Singular();  // four coefficients per Gaussian, one direction
    f.cameras.resize(1);
    f.options.chroma_sh_degree = 1;
    return f;
  });
  add("neutral targets", [] {
    Fit f = Ordinary();
    f.target = [](int) { return OneColor(0.0f, 0.0f, 1.0f); };
    return f;
  });
  add("a saturated colour", [] {
    Fit f = Ordinary();
    f.target = [](int) { return OneColor(98.0f, -108.0f, 1.0f); };
    return f;
  });
  add("one Gaussian", [] {
    Fit f = Ordinary();
    f.geometry = CloudOf(1, 1);
    return f;
  });
}

}  // namespace color3d
