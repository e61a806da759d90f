#include "tests/support/scenes/chroma_problems.h"

#include <algorithm>
#include <memory>

#include "core/base/random.h"

namespace color3d::chroma_problems {

PosedCamera CameraAt(int view, double shift, int width, int height) {
  PosedCamera posed;
  posed.view = view;
  posed.camera.width = width;
  posed.camera.height = height;
  posed.camera.fx = posed.camera.fy = 30.0;
  posed.camera.cx = 0.5 * width;
  posed.camera.cy = 0.5 * height;
  posed.cam_from_world.translation = Eigen::Vector3d(shift, -0.1 * shift, 0.0);
  return posed;
}

GaussianModel RandomGaussians(int count, uint64_t seed) {
  Random random(seed);
  GaussianModel model;
  for (int i = 0; i < count; ++i) {
    const double z = random.NextUniform(2.0, 5.0);
    model.position.insert(model.position.end(),
                          {static_cast<float>(random.NextUniform(-0.5, 0.5) * z),
                           static_cast<float>(random.NextUniform(-0.4, 0.4) * z),
                           static_cast<float>(z)});
    for (int k = 0; k < 3; ++k) {
      model.log_scale.push_back(static_cast<float>(random.NextUniform(-2.0, -0.7)));
    }
    for (int k = 0; k < 4; ++k) {
      model.rotation.push_back(static_cast<float>(random.NextUniform(-1.0, 1.0)));
    }
    model.opacity_logit.push_back(static_cast<float>(random.NextUniform(-1.0, 3.0)));
    model.sh_l.push_back(0.0f);
  }
  return model;
}

ChromaProblem RandomProblem(int views, uint64_t seed) {
  ChromaProblem problem;
  for (int v = 0; v < views; ++v) problem.training.push_back(CameraAt(v, 0.3 * v - 0.4));
  problem.targets = [seed](int view) {
    Random random(seed, static_cast<uint64_t>(view));
    auto target = std::make_shared<ChromaTarget>();
    target->ab = Image(kWidth, kHeight, 2);
    target->weight = Image(kWidth, kHeight, 1);
    for (float& v : target->ab.data) v = static_cast<float>(random.NextUniform(-60.0, 60.0));
    for (float& v : target->weight.data) v = static_cast<float>(random.NextUniform(0.0, 1.0));
    return target;
  };
  return problem;
}

ChromaProblem ConstantProblem(int views, float a, float b, int width, int height) {
  ChromaProblem problem;
  for (int v = 0; v < views; ++v) problem.training.push_back(CameraAt(v, 0.2 * v, width, height));
  problem.targets = [=](int) {
    auto target = std::make_shared<ChromaTarget>();
    target->ab = Image(width, height, 2, a);
    std::fill_n(target->ab.Plane(1), target->ab.PlaneSize(), b);
    return target;
  };
  return problem;
}

GaussianModel Fit(const GaussianModel& geometry,
                  const ChromaProblem& problem,
                  const ChromaOptions& options,
                  int threads) {
  ThreadPool pool(threads);
  NoCheckpoints none;
  NullObserver observer;
  return FitChroma(geometry, problem, options, {pool, none, observer, CancellationToken()});
}

}  // namespace color3d::chroma_problems
