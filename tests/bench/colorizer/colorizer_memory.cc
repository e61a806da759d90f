#include "tests/bench/colorizer/colorizer_memory.h"

#include <malloc.h>

#include <algorithm>
#include <optional>
#include <string>
#include <thread>

#include "core/base/memory.h"
#include "core/colorizer/model/tensor_file.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/colorizer/scene_batch.h"

namespace color3d {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMib = 1 << 20;
constexpr int kCheckpointIterations = 25;  // the first checkpoint

// Keeps the last checkpoint.
struct LastCheckpoint : CheckpointStore {
  std::optional<std::string> Load() override { return std::nullopt; }
  bool WantsSave() override { return true; }
  void Save(const std::string& bytes) override { state = bytes; }
  std::string state;
};

struct Line {
  double at_zero = 0.0;
  double slope = 0.0;
};

// Least-squares line.
Line FitLine(const std::vector<std::pair<double, double>>& points) {
  double x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (const auto& [px, py] : points) x += px, y += py, xx += px * px, xy += px * py;
  const auto n = static_cast<double>(points.size());
  const double slope = (n * xy - x * y) / (n * xx - x * x);
  return {(y - slope * x) / n, slope};
}

// Peak resident memory while the first `count` scenes train together.
int64_t PeakOf(const MemorySubject& subject, size_t count) {
  ::malloc_trim(0);
  ResetPeakMemory();
  SceneBatch batch(subject.threads);
  std::vector<std::shared_ptr<const Colorizer>> trained(count);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < count; ++i) {
    threads.emplace_back([&, i] {
      ThreadPool pool(subject.threads);
      NullObserver silent;
      NoCheckpoints none;
      trained[i] = TrainColorizer(subject.encoder,
                                  {subject.keys[i]},
                                  subject.options,
                                  {pool, none, silent, {}},
                                  BatchPlace{batch, std::to_string(i)});
    });
  }
  for (std::thread& thread : threads) thread.join();
  return PeakMemoryBytes();
}

}  // namespace

Json TensorBytes(const MemorySubject& subject) {
  ColorizerOptions options = subject.options;
  options.iterations = kCheckpointIterations;
  ThreadPool pool(subject.threads);
  LastCheckpoint last;
  NullObserver silent;
  TrainColorizer(subject.encoder, {subject.keys.front()}, options, {pool, last, silent, {}});
  const TensorFile file = ReadTensorFile(last.state, kCheckpointFormat, "the checkpoint");
  Json bytes{{"parameters", 0}, {"optimiser", 0}, {"average", 0}};
  for (const auto& [name, array] : file.arrays) {
    const bool moment = name.starts_with("m.") || name.starts_with("v.");
    const char* part = moment                         ? "optimiser"
                       : name.starts_with("average.") ? "average"
                                                      : "parameters";
    bytes[part] = bytes[part].get<size_t>() + array.values.size() * sizeof(float);
  }
  return bytes;
}

Json PeakMemoryBySceneCount(const MemorySubject& subject, int64_t before_bytes) {
  Json result;
  std::vector<std::pair<double, double>> points;
  const size_t most = subject.keys.size();
  for (size_t count = 1;; count = std::min(2 * count, most)) {
    const double mib = static_cast<double>(PeakOf(subject, count) - before_bytes) / kMib;
    result["peaks"].push_back({{"scenes", count}, {"mib", mib}});
    if (count > 1) points.emplace_back(count, mib);
    if (count == most) break;
  }
  if (points.size() < 2) return result;
  const Line line = FitLine(points);
  result["mib_shared"] = line.at_zero;
  result["mib_per_scene"] = line.slope;
  return result;
}

}  // namespace color3d
