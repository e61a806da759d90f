#include "tests/bench/explain/jacobian.h"

#include <torch/csrc/autograd/autograd.h>
#include <torch/types.h>

#include "core/base/random.h"

namespace color3d {
namespace {

torch::Tensor RandomLike(const torch::Tensor& x, uint64_t seed) {
  torch::Tensor values = torch::empty(x.sizes(), torch::kFloat32);
  Random random(seed);
  float* data = values.data_ptr<float>();
  for (int64_t i = 0; i < values.numel(); ++i) data[i] = static_cast<float>(random.NextNormal());
  return values.to(x.scalar_type());
}

}  // namespace

double JacobianNorm(const std::function<torch::Tensor(const torch::Tensor&)>& f,
                    const torch::Tensor& x,
                    int iterations,
                    uint64_t seed) {
  const torch::Tensor at = x.detach().clone().set_requires_grad(true);
  const torch::Tensor value = f(at);
  // J^T u is linear in u; its derivative along v is J v.
  const torch::Tensor u = torch::zeros_like(value).set_requires_grad(true);
  const torch::Tensor transposed = torch::autograd::grad({value},
                                                         {at},
                                                         {u},
                                                         /*retain_graph=*/true,
                                                         /*create_graph=*/true)[0];
  torch::Tensor v = RandomLike(x, seed);
  v = v / v.norm();
  double norm = 0.0;
  for (int i = 0; i < iterations; ++i) {
    const torch::Tensor image =
        torch::autograd::grad({transposed}, {u}, {v}, /*retain_graph=*/true)[0].detach();
    norm = image.norm().item<double>();
    if (norm == 0.0) return 0.0;
    const torch::Tensor back =
        torch::autograd::grad({value}, {at}, {image}, /*retain_graph=*/true)[0].detach();
    const torch::Tensor length = back.norm();
    if (length.item<double>() == 0.0) return norm;
    v = back / length;
  }
  return norm;
}

}  // namespace color3d
