// color3d-kernel-bench: Google Benchmark of each numeric kernel of the splat engine. Arguments:
// Gaussians, channels, threads, at 500x375 px. COLOR3D_ISA limits the instruction set.
#include <benchmark/benchmark.h>

#include "core/simd/instruction_set.h"
#include "core/splat/geometry/regularize.h"
#include "core/splat/motion/motion.h"
#include "tests/bench/splat/synthetic_splats.h"

namespace color3d {
namespace {

using Step = void (SyntheticIteration::*)();

// Runs one iteration to set up the state of the step, then measures the step alone.
void MeasureStep(benchmark::State& state, Step step) {
  SyntheticLoad load;
  load.gaussians = static_cast<int>(state.range(0));
  load.channels = static_cast<int>(state.range(1));
  SyntheticIteration iteration(load, static_cast<int>(state.range(2)));
  iteration.Project();
  iteration.Bin();
  iteration.Forward();
  iteration.Loss();
  iteration.Backward();
  iteration.ProjectBackward();
  for (auto _ : state) (iteration.*step)();
  state.counters["pairs"] = static_cast<double>(iteration.Pairs());
  state.SetLabel(std::string(ActiveInstructionSet()));
}

void MeasurePenalties(benchmark::State& state) {
  ThreadPool pool(1);
  const ParameterBlock p(kColorRow + 16, state.range(0));
  ParameterBlock gradient(kColorRow + 16, state.range(0));
  for (auto _ : state) AddPenaltyGradients(p, 0.01f, 0.01f, pool, gradient);
}

// Moves Gaussians to a time, and computes the adjoint.
void MeasureMotion(benchmark::State& state) {
  constexpr float kMoment = 0.3f;
  ThreadPool pool(1);
  const ParameterBlock moving(kColorRow + 1 + kMotionRows, state.range(0));
  ParameterBlock at(kColorRow + 1, state.range(0)), gradient;
  for (auto _ : state) {
    ApplyMotion({moving, kColorRow + 1, kMoment, 0}, pool, at);
    ApplyMotionBackward({moving, kColorRow + 1, kMoment, 0}, at, at, pool, gradient);
  }
}

void Loads(benchmark::internal::Benchmark* b) {
  b->Unit(benchmark::kMillisecond)->UseRealTime()->MinTime(0.2);
  b->ArgNames({"gaussians", "channels", "threads"});
  for (const int channels : {1, 3}) {
    for (const int threads : {1, 2}) b->Args({50'000, channels, threads});
  }
}

BENCHMARK_CAPTURE(MeasureStep, project, &SyntheticIteration::Project)->Apply(Loads);
BENCHMARK_CAPTURE(MeasureStep, bin, &SyntheticIteration::Bin)->Apply(Loads);
BENCHMARK_CAPTURE(MeasureStep, forward, &SyntheticIteration::Forward)->Apply(Loads);
BENCHMARK_CAPTURE(MeasureStep, loss, &SyntheticIteration::Loss)->Apply(Loads);
BENCHMARK_CAPTURE(MeasureStep, backward, &SyntheticIteration::Backward)->Apply(Loads);
BENCHMARK_CAPTURE(MeasureStep, project_backward, &SyntheticIteration::ProjectBackward)
    ->Apply(Loads);
BENCHMARK_CAPTURE(MeasureStep, adam, &SyntheticIteration::Adam)->Apply(Loads);
BENCHMARK(MeasurePenalties)->Unit(benchmark::kMillisecond)->MinTime(0.2)->Arg(50'000);
BENCHMARK(MeasureMotion)->Unit(benchmark::kMillisecond)->MinTime(0.2)->Arg(20'000);

}  // namespace
}  // namespace color3d

BENCHMARK_MAIN();
