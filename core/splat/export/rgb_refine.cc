#include "core/splat/export/rgb_refine.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/base/range_check.h"
#include "core/color/lab.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/motion/geometry_in_time.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/raster/raster_camera.h"
#include "core/splat/raster/render.h"
#include "core/splat/training/adam.h"
#include "core/splat/training/training_targets.h"

namespace color3d {
namespace {

constexpr float kBlack[3] = {0.0f, 0.0f, 0.0f};
constexpr double kRestDivisor = 20.0;  // as in training
constexpr double kLastRate = 0.1;
constexpr double kBestPsnrDb = 99.0;

// Geometry rows of the model, then the coefficients of R, G and B.
ParameterBlock RgbParameters(const GaussianModel& model, const RgbHarmonics& rgb) {
  const ParameterBlock from = ParametersFromModel(model);
  const int coefficients = ShCoefficients(rgb.degree);
  ParameterBlock p(kColorRow + 3 * coefficients, from.count());
  for (int r = 0; r < kColorRow; ++r) std::copy_n(from.Row(r), from.count(), p.Row(r));
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < coefficients; ++k) {
      float* row = p.Row(kColorRow + c * coefficients + k);
      for (int64_t i = 0; i < p.count(); ++i) row[i] = rgb.sh[(i * coefficients + k) * 3 + c];
    }
  }
  return p;
}

RgbHarmonics HarmonicsOf(const ParameterBlock& p, int degree) {
  const int coefficients = ShCoefficients(degree);
  RgbHarmonics rgb;
  rgb.degree = degree;
  rgb.sh.resize(static_cast<size_t>(p.count()) * coefficients * 3);
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < coefficients; ++k) {
      const float* row = p.Row(kColorRow + c * coefficients + k);
      for (int64_t i = 0; i < p.count(); ++i) rgb.sh[(i * coefficients + k) * 3 + c] = row[i];
    }
  }
  return rgb;
}

class Refiner {
 public:
  Refiner(const GaussianModel& model,
          const RgbHarmonics& start,
          const std::vector<RgbView>& views,
          const RgbRefineOptions& options,
          const RunControl& run)
      : views_(views),
        options_(options),
        run_(run),
        degree_(start.degree),
        parameters_(RgbParameters(model, start)),
        in_time_(model, run.pool) {
    const int coefficients = ShCoefficients(degree_);
    color_.channels = 3;
    for (int c = 0; c < 3; ++c) {
      color_.channel[c] = {kColorRow + c * coefficients, coefficients, 0.5f, true};
    }
    for (const RgbView& view : views) {
      cameras_.push_back(MakeRasterCamera(view.camera, view.cam_from_world));
    }
  }

  void RenderTargets(const GaussianModel& model) {
    for (const RgbView& view : views_) {
      run_.cancel.ThrowIfCancelled();
      const RenderedView rendered =
          RenderView(model, view.camera, view.cam_from_world, run_.pool, 0.0f, view.time_s);
      targets_.push_back(PlanesFromImage(SrgbFromLab(rendered.lab, run_.pool), 0.0f, 1.0f));
    }
  }

  RgbLoss Measure() {
    RgbLoss loss;
    loss.worst_psnr_db = kBestPsnrDb;
    loss.worst_view = 0;
    for (size_t v = 0; v < views_.size(); ++v) {
      run_.cancel.ThrowIfCancelled();
      pipeline_.Forward({At(v), color_, cameras_[v]}, kBlack, false, run_.pool);
      const double psnr = Psnr(Residual(v));
      loss.mean_psnr_db += psnr / static_cast<double>(views_.size());
      if (psnr < loss.worst_psnr_db) {
        loss.worst_psnr_db = psnr;
        loss.worst_view = static_cast<int>(v);
      }
    }
    return loss;
  }

  // Returns false if a value was not finite.
  bool Refine() {
    std::vector<size_t> order;
    for (size_t v = 0; v < views_.size(); ++v) {
      if (views_[v].fitted) order.push_back(v);
    }
    AdamMoments moments{parameters_.ZerosOfSameShape(), parameters_.ZerosOfSameShape()};
    Random random(options_.seed);
    const int64_t total = static_cast<int64_t>(order.size()) * options_.epochs;
    int64_t step = 0;
    for (int epoch = 0; epoch < options_.epochs; ++epoch) {
      for (size_t i = order.size(); i > 1; --i) {  // Fisher-Yates
        std::swap(order[i - 1], order[random.NextBelow(static_cast<uint32_t>(i))]);
      }
      for (const size_t v : order) {
        run_.cancel.ThrowIfCancelled();
        const ParameterBlock& at = At(v);
        pipeline_.Forward({at, color_, cameras_[v]}, kBlack, false, run_.pool);
        if (!std::isfinite(Residual(v))) return false;
        pipeline_.Backward({at, color_, cameras_[v]},
                           residual_,
                           run_.pool,
                           {GradientScope::kColorOnly, gradient_});
        const double done = static_cast<double>(step) / static_cast<double>(total);
        if (!AdamStep(gradient_, Rates(done), ++step, run_.pool, parameters_, moments))
          return false;
        run_.progress.OnProgress(step, total, "refining the RGB colours of the export");
      }
    }
    return true;
  }

  RgbHarmonics Result() const { return HarmonicsOf(parameters_, degree_); }

 private:
  // The Gaussians as view `v` sees them; valid until the next call.
  const ParameterBlock& At(size_t v) { return in_time_.At(parameters_, views_[v].time_s); }

  std::vector<float> Rates(double done) const {
    const double rate = options_.learning_rate * std::pow(kLastRate, done);
    std::vector<float> rates(parameters_.rows(), 0.0f);
    for (const ColorChannel& channel : color_.channel) {
      for (int k = 0; k < channel.coefficients; ++k) {
        rates[channel.row + k] = static_cast<float>(k == 0 ? rate : rate / kRestDivisor);
      }
    }
    return rates;
  }

  // Writes clamped picture minus target to residual_; returns the mean square.
  double Residual(size_t v) {
    const PlaneBuffer& picture = pipeline_.color();
    const PlaneBuffer& target = targets_[v];
    residual_.Reset(target.width, target.height, 3);
    double squares = 0.0;
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < target.height; ++y) {
        const float *in = picture.Row(c, y), *wanted = target.Row(c, y);
        float* out = residual_.Row(c, y);
        float row_squares = 0.0f;
        for (int x = 0; x < target.width; ++x) {
          out[x] = std::clamp(in[x], 0.0f, 1.0f) - wanted[x];
          row_squares += out[x] * out[x];
        }
        squares += row_squares;
      }
    }
    return squares / (3.0 * target.width * target.height);
  }

  static double Psnr(double mean_square) {
    return std::min(kBestPsnrDb, -10.0 * std::log10(std::max(mean_square, 1e-12)));
  }

  const std::vector<RgbView>& views_;
  const RgbRefineOptions& options_;
  const RunControl& run_;
  int degree_;
  ParameterBlock parameters_;
  GeometryInTime in_time_;
  ColorSpec color_;
  std::vector<RasterCamera> cameras_;
  std::vector<PlaneBuffer> targets_;
  SplatPipeline pipeline_;
  PlaneBuffer residual_;
  ParameterBlock gradient_;
};

}  // namespace

void RgbRefineOptions::Validate() const {
  const RangeCheck check("colour refinement option");
  check("epochs", epochs, 0, 1000);
  check("learning_rate", learning_rate, 1e-6, 1.0);
}

RgbRefinement RefineRgbHarmonics(const GaussianModel& model,
                                 RgbHarmonics start,
                                 const std::vector<RgbView>& views,
                                 const RgbRefineOptions& options,
                                 const RunControl& run) {
  options.Validate();
  if (views.empty()) throw InvalidArgument("RGB refinement needs at least one view");
  Refiner refiner(model, start, views, options, run);
  refiner.RenderTargets(model);
  RgbRefinement result;
  result.before = refiner.Measure();
  const bool finite = refiner.Refine();
  if (finite) result.after = refiner.Measure();
  if (finite && result.after.mean_psnr_db > result.before.mean_psnr_db) {
    result.harmonics = refiner.Result();
  } else {
    result.after = result.before;
    result.harmonics = std::move(start);
  }
  return result;
}

}  // namespace color3d
