#include "core/splat/training/training_state.h"

#include <numeric>
#include <utility>

namespace color3d {

int ViewOrder::Next(int view_count, Random& random) {
  if (next >= static_cast<int64_t>(views.size())) {
    views.resize(view_count);
    std::iota(views.begin(), views.end(), 0);
    for (int i = view_count - 1; i > 0; --i) {  // Fisher-Yates
      std::swap(views[i], views[random.NextBelow(static_cast<uint32_t>(i) + 1)]);
    }
    next = 0;
  }
  return views[next++];
}

void WriteState(const TrainingState& state, CheckpointWriter& writer) {
  writer.Block(state.parameters);
  writer.Block(state.moments.first);
  writer.Block(state.moments.second);
  writer.Value(state.random.state());
  writer.Value<uint64_t>(state.order.views.size());
  for (const int32_t view : state.order.views) writer.Value(view);
  writer.Value(state.order.next);
  writer.Value(state.iteration);
  writer.Value(state.rate_scale);
  writer.Value(state.restores);
  writer.Value(state.mean_error);
  writer.Value(state.elapsed_seconds);
}

void ReadState(CheckpointReader& reader, TrainingState& state) {
  state.parameters = reader.Block();
  state.moments.first = reader.Block();
  state.moments.second = reader.Block();
  state.random = Random(reader.Value<Random::State>());
  state.order.views.resize(reader.Count(sizeof(int32_t)));
  for (int32_t& view : state.order.views) view = reader.Value<int32_t>();
  state.order.next = reader.Value<int64_t>();
  state.iteration = reader.Value<int64_t>();
  state.rate_scale = reader.Value<double>();
  state.restores = reader.Value<int32_t>();
  state.mean_error = reader.Value<double>();
  state.elapsed_seconds = reader.Value<double>();
}

}  // namespace color3d
