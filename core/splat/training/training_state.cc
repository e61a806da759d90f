#include "core/splat/training/training_state.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <type_traits>

#include "core/base/digest.h"

namespace color3d {
namespace {

constexpr std::string_view kMagic = "C3DTRAIN2";
constexpr size_t kDigestBytes = 64;

class Writer {
 public:
  template <class T>
  void Value(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  void Floats(const float* values, size_t count) {
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(float));
  }
  void Text(std::string_view text) {
    Value<uint64_t>(text.size());
    bytes_.append(text);
  }
  void Block(const ParameterBlock& block) {
    Value<int32_t>(block.rows());
    Value<int64_t>(block.count());
    for (int r = 0; r < block.rows(); ++r) Floats(block.Row(r), block.count());
  }
  void Vector(const AlignedFloats& values) {
    Value<uint64_t>(values.size());
    Floats(values.data(), values.size());
  }
  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Never reads beyond the end; `ok` turns false instead.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}
  bool ok() const { return ok_; }

  template <class T>
  T Value() {
    T value{};
    Copy(&value, sizeof(T));
    return value;
  }
  std::string_view Text() {
    const uint64_t size = Value<uint64_t>();
    if (!Has(size)) return {};
    const std::string_view text = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return text;
  }
  ParameterBlock Block() {
    const int32_t rows = Value<int32_t>();
    const int64_t count = Value<int64_t>();
    if (rows < 0 || rows > 256 || count < 0 || count > (int64_t{1} << 32) ||
        !Has(static_cast<uint64_t>(rows) * static_cast<uint64_t>(count) * sizeof(float))) {
      ok_ = false;
      return {};
    }
    ParameterBlock block(rows, count);
    for (int r = 0; r < rows; ++r) Copy(block.Row(r), count * sizeof(float));
    return block;
  }
  AlignedFloats Vector() {
    const uint64_t size = Value<uint64_t>();
    if (size > rest_.size() / sizeof(float)) ok_ = false;
    AlignedFloats values(ok_ ? size : 0);
    Copy(values.data(), values.size() * sizeof(float));
    return values;
  }

 private:
  bool Has(uint64_t bytes) {
    ok_ = ok_ && bytes <= rest_.size();
    return ok_;
  }
  void Copy(void* to, uint64_t bytes) {
    if (bytes == 0 || !Has(bytes)) return;
    std::memcpy(to, rest_.data(), bytes);
    rest_.remove_prefix(bytes);
  }

  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace

int TrainingState::NextView(int view_count) {
  if (next_in_order >= static_cast<int64_t>(order.size())) {
    order.resize(view_count);
    std::iota(order.begin(), order.end(), 0);
    for (int i = view_count - 1; i > 0; --i) {
      std::swap(order[i], order[random.NextBelow(static_cast<uint32_t>(i) + 1)]);
    }
    next_in_order = 0;
  }
  return order[next_in_order++];
}

std::string SerializeTrainingState(const TrainingState& state, std::string_view fingerprint) {
  Writer w;
  w.Text(kMagic);
  w.Text(fingerprint);
  w.Block(state.parameters);
  w.Block(state.moments.first);
  w.Block(state.moments.second);
  w.Vector(state.statistics.gradient);
  w.Vector(state.statistics.count);
  w.Vector(state.statistics.radius);
  w.Value(state.random.state());
  w.Value(state.iteration);
  w.Value<uint64_t>(state.order.size());
  for (const int32_t view : state.order) w.Value(view);
  w.Value(state.next_in_order);
  w.Value(state.rate_scale);
  w.Value(state.restores);
  w.Value(state.mean_error);
  w.Value(state.elapsed_seconds);
  w.Value(state.densified_at);
  std::string bytes = w.Take();
  return bytes + Sha256Hex(bytes);
}

bool ParseTrainingState(std::string_view bytes,
                        std::string_view fingerprint,
                        TrainingState& state) {
  if (bytes.size() < kDigestBytes) return false;
  const std::string_view content = bytes.substr(0, bytes.size() - kDigestBytes);
  if (Sha256Hex(content) != bytes.substr(content.size())) return false;
  Reader r(content);
  if (r.Text() != kMagic || r.Text() != fingerprint) return false;
  TrainingState read;
  read.parameters = r.Block();
  read.moments.first = r.Block();
  read.moments.second = r.Block();
  read.statistics.gradient = r.Vector();
  read.statistics.count = r.Vector();
  read.statistics.radius = r.Vector();
  read.random = Random(r.Value<Random::State>());
  read.iteration = r.Value<int64_t>();
  const uint64_t views = r.Value<uint64_t>();
  if (!r.ok() || views > content.size()) return false;
  read.order.resize(views);
  for (int32_t& view : read.order) view = r.Value<int32_t>();
  read.next_in_order = r.Value<int64_t>();
  read.rate_scale = r.Value<double>();
  read.restores = r.Value<int32_t>();
  read.mean_error = r.Value<double>();
  read.elapsed_seconds = r.Value<double>();
  read.densified_at = r.Value<int64_t>();
  if (!r.ok()) return false;
  state = std::move(read);
  return true;
}

}  // namespace color3d
